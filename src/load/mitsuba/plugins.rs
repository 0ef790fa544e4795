//! The table of plugins and parameters, `plugins.txt`: what of Mitsuba's is supported, ignored, replaced or refused.

/// One row a line: element, plugin, parameter (empty for the plugin itself), support, version, note, example.
pub(super) const TABLE: &str = include_str!("plugins.txt");

/// The columns of a row, without the blanks around them.
pub(super) fn columns(row: &'static str) -> [&'static str; 7] {
    let mut columns = row.splitn(7, '|').map(str::trim);
    std::array::from_fn(|_| columns.next().unwrap_or(""))
}

fn rows() -> impl Iterator<Item = [&'static str; 7]> {
    TABLE.lines().filter(|line| !line.starts_with('#')).map(columns)
}

/// Why a plugin is refused; `None` if it is not, or is not known.
pub(super) fn refusal(element: &str, plugin: &str) -> Option<&'static str> {
    rows().find(|row| row[..3] == [element, plugin, ""] && row[3] == "refused").map(|row| row[5])
}

/// Treatment of a documented parameter that no reader asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unread {
    /// It does not change the expected picture.
    Ignored,
    /// It changes the picture, unless it has the value `unless`.
    Refused { unless: Option<&'static str>, why: &'static str },
}

/// The row of a parameter that is ignored or refused; `None` if there is none.
pub(super) fn unread(element: &str, plugin: &str, parameter: &str) -> Option<Unread> {
    let [_, _, _, support, _, why, _] = rows().find(|row| row[..3] == [element, plugin, parameter])?;
    match support {
        // The message about a replaced plugin covers its parameters.
        "ignored" | "replaced" => Some(Unread::Ignored),
        "refused" => Some(Unread::Refused { unless: None, why }),
        _ => Some(Unread::Refused { unless: Some(support.strip_prefix("refused unless ")?), why }),
    }
}

impl Unread {
    /// The reason if the parameter changes the picture with the value `value`.
    pub(super) fn refusal(self, value: Option<&str>) -> Option<&'static str> {
        match self {
            Unread::Ignored => None,
            Unread::Refused { unless, why } => (!is_same(unless, value)).then_some(why),
        }
    }
}

/// Texts that are the same word or number.
fn is_same(a: Option<&str>, b: Option<&str>) -> bool {
    let (Some(a), Some(b)) = (a.map(str::trim), b.map(str::trim)) else { return false };
    let number = |text: &str| text.parse::<f64>().ok();
    a.eq_ignore_ascii_case(b) || number(a).is_some_and(|x| number(b) == Some(x))
}
