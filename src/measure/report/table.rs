//! A table, for a page or for a terminal.

/// Cells as text; the first column names, the others hold numbers.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Names of the columns.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<S: Into<String>>(head: impl IntoIterator<Item = S>) -> Table {
        Table { head: head.into_iter().map(Into::into).collect(), rows: vec![] }
    }

    /// Appends a row.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// Lines with aligned columns.
    pub fn lines(&self) -> Vec<String> {
        let all = || std::iter::once(&self.head).chain(&self.rows);
        let columns = all().map(Vec::len).max().unwrap_or(0);
        let width = |c: usize| all().filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let line = |row: &Vec<String>| {
            let cell = |(c, text): (usize, &String)| {
                let blanks = " ".repeat(widths[c] - text.chars().count());
                if c == 0 { format!("{text}{blanks}") } else { format!("  {blanks}{text}") }
            };
            row.iter().enumerate().map(cell).collect::<String>().trim_end().to_owned()
        };
        all().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let mut table = Table::new(["a", "number"]);
        table.row(["longer", "1"]);
        table.row(["µ", "234"]);
        assert_eq!(table.lines(), ["a       number", "longer       1", "µ          234"]);
    }
}
