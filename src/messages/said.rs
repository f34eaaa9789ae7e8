//! Text from the network, escaped for display.

use std::fmt::Write;

/// A name, a frame or a reason from the network for a message or a log line: see [`escaped`].
pub fn said(text: &str) -> String {
    escaped(text, 120)
}

/// A text on one line that moves no cursor, control characters escaped, and at most so many of its characters.
pub fn escaped(text: &str, most: usize) -> String {
    let mut shown = String::new();
    for letter in text.chars().take(most) {
        if letter.is_control() || is_invisible(letter) {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    if text.chars().nth(most).is_some() {
        // A String takes all that is written.
        let _ = write!(shown, "... ({} bytes)", text.len());
    }
    shown
}

/// Line and paragraph separators, and marks that turn the direction of what follows.
fn is_invisible(letter: char) -> bool {
    matches!(letter, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_said_stays_on_its_line_and_is_short() {
        assert_eq!(said("map"), "map");
        assert_eq!(said("a\nERROR forged\r\u{1b}[2J\0"), "a\\nERROR forged\\r\\u{1b}[2J\\u{0}");
        assert_eq!(said("\u{202e}drawkcab\u{2028}"), "\\u{202e}drawkcab\\u{2028}");
        let long = "é".repeat(5_000_000);
        assert!(said(&long).len() < 300 && said(&long).ends_with("... (10000000 bytes)"));
    }
}
