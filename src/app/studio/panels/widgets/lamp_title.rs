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

/// A sentence with the titles of `lamps` in place of their names; files keep theirs.
pub fn with_lamp_titles(sentence: &str, lamps: &[String]) -> String {
    let is_of_name = |c: char| c.is_alphanumeric() || "_-./\\".contains(c);
    let mut said = String::new();
    let mut rest = sentence;
    while let Some(start) = rest.find(is_of_name) {
        let (before, from) = rest.split_at(start);
        let end = from.find(|c| !is_of_name(c)).unwrap_or(from.len());
        let (word, after) = from.split_at(end);
        let name = word.trim_end_matches('.');
        said += before;
        if lamps.iter().any(|lamp| lamp == name) {
            said += &lamp_title(name);
        } else {
            said += name;
        }
        said += &word[name.len()..];
        rest = after;
    }
    said + rest
}

#[cfg(test)]
mod tests {
    use super::{lamp_title, with_lamp_titles};

    #[test]
    fn lamps_in_a_sentence_have_titles_and_files_their_names() {
        let lamps = ["olat_00", "olat_03", "olat5", "key_2"].map(str::to_owned);
        for (said, shown) in [
            ("Exchange olat_03 and olat5.", "Exchange lamp 3 and lamp 5."),
            ("pose00/olat_03.png: black (olat_03)", "pose00/olat_03.png: black (lamp 3)"),
            ("1 of 12 lamps: olat_00, key_2", "1 of 12 lamps: lamp 0, key_2"),
            ("Light_7, −3.5°… of größe_3", "Light_7, −3.5°… of größe_3"),
            ("", ""),
        ] {
            assert_eq!(with_lamp_titles(said, &lamps), shown);
        }
    }

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
