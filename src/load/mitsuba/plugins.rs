//! The table of plugins and parameters, `plugins.txt`: what of Mitsuba's is supported, ignored, replaced or refused.

/// One row a line: element, plugin, parameter (empty for the plugin itself), support, version, note, example.
pub(super) const TABLE: &str = include_str!("plugins.txt");

/// The columns of a row, without the blanks around them.
pub(super) fn columns(row: &'static str) -> [&'static str; 7] {
    let mut columns = row.splitn(7, '|').map(str::trim);
    std::array::from_fn(|_| columns.next().unwrap_or(""))
}

/// Why a plugin is refused; `None` if it is not, or is not known.
pub(super) fn refusal(element: &str, plugin: &str) -> Option<&'static str> {
    let rows = TABLE.lines().filter(|line| !line.starts_with('#')).map(columns);
    rows.filter(|row| row[..3] == [element, plugin, ""] && row[3] == "refused").map(|row| row[5]).next()
}
