# One-line summary of skipped tests, from their records: need, crate, test, reason.
BEGIN { FS = "\t" }
!seen[$1, $2, $3]++ {
	if (!count[$1]++) {
		needs[++kinds] = $1
		reason[$1] = $4
	}
}
END {
	for (i = 1; i <= kinds; i++)
		list = list (i > 1 ? ", " : "") count[needs[i]] " for lack of " needs[i] " (" reason[needs[i]] ")"
	print "Skipped tests: " (kinds ? list : "none")
}
