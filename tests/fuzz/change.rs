//! Random changes to a valid file, accidental and malicious.

/// Integers that overflow careless arithmetic.
const WHOLE: [u64; 12] =
    [0, 1, u64::MAX, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 1 << 62, 1 << 63];

/// The same as text, and values that are not numbers.
const TYPED: [&str; 32] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "3",
    "16",
    "255",
    "65536",
    "2147483647",
    "2147483648",
    "-2147483648",
    "4294967296",
    "4611686018427387904",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "3.4e38",
    "1e999",
    "0.5",
    "\"\"",
    "\"../../x\"",
    "[]",
    "{}",
    "true",
    "null",
];

/// Stream of random draws; zeros once it is used up.
struct Draw<'a>(&'a [u8]);

impl Draw<'_> {
    fn byte(&mut self) -> usize {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        usize::from(first)
    }

    /// A number below `end`; 0 if `end` is 0.
    fn below(&mut self, end: usize) -> usize {
        let number = (0..3).fold(0, |number, _| number << 8 | self.byte());
        // Small numbers stay unchanged, so that a shorter stream changes the same places.
        if end == 0 { 0 } else { number % end }
    }

    /// A length, short more often than long.
    fn length(&mut self, most: usize) -> usize {
        let long = self.byte();
        let length = if long < 200 { 1 + long % 16 } else { self.below(most) };
        length.min(most)
    }
}

/// One of the `files`, changed according to `draws`. `of_text`: the files hold words and numbers.
pub(crate) fn changed(files: &[&[u8]], of_text: bool, draws: &[u8]) -> (usize, Vec<u8>) {
    let mut draw = Draw(draws);
    let chosen = draw.below(files.len());
    let mut file = files[chosen].to_vec();
    // With few changes, most files are still read to the end.
    for _ in 0..[1, 1, 1, 2, 2, 3, 5, 12][draw.byte() % 8] {
        if !draw.0.is_empty() {
            change(&mut file, files, of_text, &mut draw);
        }
    }
    (chosen, file)
}

fn change(file: &mut Vec<u8>, files: &[&[u8]], of_text: bool, draw: &mut Draw) {
    let what = draw.byte() % if of_text { 16 } else { 12 };
    // Headers are at the start.
    let head = if draw.byte() < 128 { 512 } else { usize::MAX };
    let at = draw.below(file.len().min(head));
    let most = file.len() - at;
    match what {
        0 | 1 if most > 0 => file[at] ^= 1 << (draw.byte() % 8),
        2 if most > 0 => file[at] = draw.byte() as u8,
        3..=5 if !of_text => {
            let value = WHOLE[draw.byte() % WHOLE.len()].wrapping_add(draw.byte() as u64 % 3);
            let size = [2, 4, 4, 8][draw.byte() % 4].min(most);
            let bytes = match draw.byte() % 3 {
                0 => value.to_le_bytes(),
                1 => [f64::NAN, f64::INFINITY, 1e308, -1.0][draw.byte() % 4].to_le_bytes(),
                _ => (value << (64 - 8 * size.max(1) as u32)).to_be_bytes(),
            };
            file[at..at + size].copy_from_slice(&bytes[..size]);
        }
        6 => {
            let length = draw.length(most);
            file.drain(at..at + length);
        }
        7 => {
            let length = draw.length(most);
            let times = if draw.byte() < 16 { 1000 } else { 1 };
            let again = file[at..at + length].repeat(times.min(1 + 100_000 / length.max(1)));
            file.splice(at..at, again);
        }
        8 => file.truncate(at),
        9 => {
            let other = files[draw.below(files.len())];
            let from = draw.below(other.len());
            let length = draw.length(other.len() - from);
            let over = draw.length(most);
            file.splice(at..at + over, other[from..from + length].iter().copied());
        }
        10 => {
            let length = draw.length(16);
            let bytes: Vec<u8> = (0..length).map(|_| draw.byte() as u8).collect();
            file.splice(at..at, bytes);
        }
        _ => retype(file, draw),
    }
}

/// Replaces one of the file's numbers with another.
fn retype(file: &mut Vec<u8>, draw: &mut Draw) {
    let is_number = |b: u8| b.is_ascii_digit() || b"+-.".contains(&b);
    let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
    let begins = |i: usize| is_number(file[i]) && (i == 0 || !(is_number(file[i - 1]) || is_word(file[i - 1])));
    let starts: Vec<usize> = (0..file.len()).filter(|&i| begins(i)).collect();
    let Some(&start) = starts.get(draw.below(starts.len())) else { return };
    let length = file[start..].iter().take_while(|&&b| is_number(b) || is_word(b)).count();
    let typed = TYPED[draw.byte() % TYPED.len()];
    file.splice(start..start + length, typed.bytes());
}

/// Corrects the checksums of a PNG's chunks, so that their contents are read.
// The signature of a repair; others change the length.
#[expect(clippy::ptr_arg)]
pub fn png_checksums(file: &mut Vec<u8>) {
    let mut at = 8;
    while let Some(length) = file.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(part) = file.get(at + 4..at + 8 + length) else { return };
        let sum = crc32fast::hash(part).to_be_bytes();
        let end = at + 8 + length;
        let Some(place) = file.get_mut(end..end + 4) else { return };
        place.copy_from_slice(&sum);
        at = end + 4;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_draws_change_any_file() {
        let files: [&[u8]; 4] = [b"", b"a", b"size = 12\nscale = [1.5, -2]\n", &[0; 700]];
        let mut state = 1u64;
        let mut met = std::collections::HashSet::new();
        for _ in 0..20_000 {
            let draws: Vec<u8> = (0..24)
                .map(|_| {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
                    (state >> 56) as u8
                })
                .collect();
            let (chosen, file) = changed(&files, state & 1 == 0, &draws);
            met.insert((chosen, String::from_utf8_lossy(&file).contains("4611686018427387904")));
        }
        assert!(met.contains(&(2, true)) && met.len() >= 5, "{met:?}");
        assert_eq!(changed(&files, true, &[0, 0, 2, 0]).1, files[2]);
    }

    #[test]
    fn checksums_are_those_of_a_png() {
        let sum = |bytes: &[u8]| crc32fast::hash(bytes).to_be_bytes();
        let mut good = b"\x89PNG\r\n\x1a\n\0\0\0\x02tESTab".to_vec();
        good.extend(sum(b"tESTab"));
        good.extend(b"\0\0\0\0IEND");
        good.extend(sum(b"IEND"));
        let mut bad = good.clone();
        bad[18] ^= 1;
        bad[30] ^= 1;
        png_checksums(&mut bad);
        assert_eq!(bad, good);
        bad.truncate(20);
        png_checksums(&mut bad);
        png_checksums(&mut Vec::new());
    }
}
