//! Names of lamps for people.

/// `lamp 35` of `olat_35`, `light_35` and `lamp_35`, the names of files; other names stay.
pub fn lamp_title(name: &str) -> String {
    let lower = name.to_ascii_lowercase();
    let number = ["olat", "light", "lamp"].into_iter().find_map(|stem| {
        let digits = lower.strip_prefix(stem)?.trim_start_matches(['_', '-', '.', ' ']);
        let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        is_number.then_some(digits)
    });
    match number.map(|digits| digits.trim_start_matches('0')) {
        None => name.to_owned(),
        Some("") => "lamp 0".to_owned(),
        Some(number) => format!("lamp {number}"),
    }
}

#[cfg(test)]
mod tests {
    use super::lamp_title;

    #[test]
    fn numbered_files_are_lamps() {
        for (name, title) in [
            ("olat_35", "lamp 35"),
            ("olat_00", "lamp 0"),
            ("Light-007", "lamp 7"),
            ("lamp12", "lamp 12"),
            ("olat_07b", "olat_07b"),
            ("olat", "olat"),
            ("key", "key"),
            ("l\u{e4}mpchen_3", "l\u{e4}mpchen_3"),
        ] {
            assert_eq!(lamp_title(name), title);
        }
    }
}
