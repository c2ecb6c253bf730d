//! A comparison as a page that opens offline, its pictures inside.

use monitor::report::PictureError;
use monitor::report::html::{document, escape, figure, section};

use super::text::ROWS;
use super::{CRITERIA, Comparison, MachineReport};

/// A table of texts, the first row its heading.
fn table(rows: &[Vec<String>]) -> String {
    let line = |(index, row): (usize, &Vec<String>)| {
        let cells: String = row
            .iter()
            .enumerate()
            .map(|(column, cell)| {
                let tag = if index == 0 || column == 0 { "th" } else { "td" };
                format!("<{tag}>{}</{tag}>", escape(cell))
            })
            .collect();
        format!("<tr>{cells}</tr>\n")
    };
    let lines: String = rows.iter().enumerate().map(line).collect();
    format!("<table class=\"figures\">\n{lines}</table>\n")
}

impl Comparison {
    /// The page.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn page(&self) -> Result<String, PictureError> {
        let mut names = vec![String::new()];
        names.extend(self.machines.iter().map(|machine| machine.name.clone()));
        let mut body = format!("<h1>Comparison</h1>\n<p>{}</p>\n", escape(&self.jobs.join(", ")));
        let rows = ROWS.map(|(name, value)| self.row(name, value));
        let rows: Vec<Vec<String>> = [names.clone()].into_iter().chain(rows).collect();
        body += &section("Figures", &(table(&rows) + &self.refusals()));
        body += &section("Ranking", &self.ranking()?);
        let times = figure(self.times()?, "Time of each job");
        let errors = figure(self.errors()?, "Largest distance of a mark from its line");
        body += &section("Jobs", &(times + &errors));
        for (machine, drawn) in self.machines.iter().zip(&self.drawn) {
            let motors = figure(
                drawn.motors()?,
                "Torque over speed of each motor, dot by dot, and what it can give",
            );
            let area = figure(drawn.area()?, "What is reached of the area, and the first job");
            body += &section(&escape(&machine.name), &(motors + &area + &binding(machine)));
        }
        if let Some(printed) = &self.table_7_1 {
            body += &printed.html();
            let mut rows = vec![vec!["erratum".to_owned(), String::new()]];
            rows.extend(self.errata.iter().map(|it| vec![it.id.to_owned(), it.text.to_owned()]));
            body += &section("Errata", &table(&rows).replace(" class=\"figures\"", ""));
        }
        Ok(document("Comparison of machines", &body))
    }

    fn row(&self, name: &str, value: fn(&MachineReport) -> Option<String>) -> Vec<String> {
        // A page does not show spaces at the start of a cell.
        let mut row = vec![name.replace("  ", "\u{2003}")];
        row.extend(self.machines.iter().map(|it| value(it).unwrap_or_else(|| "–".to_owned())));
        row
    }

    fn refusals(&self) -> String {
        let refused = self.machines.iter().filter_map(|machine| {
            let reason = machine.refused.as_ref()?;
            Some(format!("<p>{}: {}</p>\n", escape(&machine.name), escape(reason)))
        });
        refused.collect()
    }

    fn ranking(&self) -> Result<String, PictureError> {
        let mut rows = vec![vec!["criterion".to_owned(), "weight".to_owned()]];
        rows[0].extend(self.machines.iter().map(|machine| machine.name.clone()));
        for (index, (name, weight)) in CRITERIA.into_iter().zip(self.weights.all()).enumerate() {
            let mut row = vec![name.to_owned(), weight.to_string()];
            row.extend(self.machines.iter().map(|machine| {
                machine.shares[index].map_or_else(|| "–".to_owned(), |it| format!("{it:.2}"))
            }));
            rows.push(row);
        }
        let picture = figure(self.shares()?, "What each machine has of each criterion");
        let how = "<p>Of each criterion: the value of the best machine divided by that of the machine, of the stiffness \
                   the other way round. The weights are a choice, which --weight changes; so is how much \
                   the other plants differ.</p>\n";
        Ok(picture + &table(&rows) + how)
    }
}

/// What bound the machine's motion.
fn binding(machine: &MachineReport) -> String {
    let mut rows =
        vec![["limit", "axis", "share of the time of all paths"].map(str::to_owned).to_vec()];
    rows.extend(machine.binding.iter().map(|it| {
        let axis = it.axis.clone().unwrap_or_default();
        vec![it.limit.clone(), axis, format!("{:.1} %", it.share * 100.0)]
    }));
    table(&rows)
}
