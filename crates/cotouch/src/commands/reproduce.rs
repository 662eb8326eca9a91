//! `cotouch reproduce`: the seeds' figures and tables, what was printed beside what comes out.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;
use serde_json::Value as Json;

use crate::experiments::{self, Claim, Experiment, Outcome};
use crate::failure::{Failure, Verdict};
use crate::output::{Output, write_file};

/// Where everything goes when nothing is said.
const DEFAULT_FOLDER: &str = "reproduced";

/// One figure or table.
#[derive(Serialize)]
struct Item {
    id: &'static str,
    title: &'static str,
    /// The name under which scripts know `published_value`.
    seed_value: Json,
    published_value: Json,
    value: Json,
    agrees: bool,
    note: String,
    claims: Vec<Claim>,
    files: Vec<String>,
    #[serde(skip)]
    rows: Vec<[String; 3]>,
    commands: Vec<String>,
    #[serde(skip)]
    figure: Option<String>,
}

#[derive(Serialize)]
struct Answer<'a> {
    items: &'a [Item],
    index: String,
}

/// Repeats the experiments that `ids` name (all, where there is none) and writes figures, tables and one page.
pub(super) fn reproduce(ids: &[String], output: &Output) -> Result<Verdict, Failure> {
    let wanted = wanted(ids)?;
    let folder = output.file.clone().unwrap_or_else(|| DEFAULT_FOLDER.into());
    let progress = output.progress("reproducing");
    let mut items = Vec::new();
    for (done, experiment) in wanted.iter().enumerate() {
        progress.show(done as f64 / wanted.len() as f64);
        items.push(write_item(experiment, (experiment.run)()?, &folder)?);
    }
    drop(progress);
    let index = folder.join("index.html");
    write_file(&index, &page(&items))?;
    let answer = Answer { items: &items, index: index.display().to_string() };
    // --out names the folder here, so that the answer itself goes to stdout only.
    Output { file: None, ..output.clone() }.answer_as(&answer, &text(&items, &answer.index))?;
    let holds = items.iter().flat_map(|item| &item.claims).all(|claim| claim.holds);
    Ok(if holds { Verdict::Good } else { Verdict::Bad })
}

fn wanted(ids: &[String]) -> Result<Vec<&'static Experiment>, Failure> {
    if ids.is_empty() || ids.iter().any(|id| id == "all") {
        return Ok(experiments::ALL.iter().collect());
    }
    let find = |id: &String| {
        experiments::ALL.iter().find(|experiment| experiment.id == id).ok_or_else(|| {
            let known: Vec<_> = experiments::ALL.iter().map(|experiment| experiment.id).collect();
            Failure::usage(format!(
                "{id:?} is nothing that can be reproduced; there are all, {}",
                known.join(", ")
            ))
        })
    };
    ids.iter().map(find).collect()
}

fn write_item(experiment: &Experiment, outcome: Outcome, folder: &Path) -> anyhow::Result<Item> {
    let mut files = Vec::new();
    for (ending, text) in [("svg", &outcome.figure), ("csv", &outcome.table)] {
        if let Some(text) = text {
            let name = format!("{}.{ending}", experiment.id);
            write_file(&folder.join(&name), text)?;
            files.push(folder.join(&name).display().to_string());
        }
    }
    let Outcome { published_value, value, agrees, note, claims, rows, commands, figure, .. } = outcome;
    let (id, title) = (experiment.id, experiment.title);
    Ok(Item {
        id,
        title,
        seed_value: published_value.clone(),
        published_value,
        value,
        agrees,
        note,
        claims,
        files,
        rows,
        commands,
        figure,
    })
}

fn text(items: &[Item], index: &str) -> String {
    let mut text = String::new();
    for item in items {
        let word = if item.agrees { "agrees" } else { "differs" };
        let _ = writeln!(text, "{}: {} ({word})", item.id, item.title);
        for [name, seed, here] in &item.rows {
            let _ = writeln!(text, "  {name}: printed {seed}; here {here}");
        }
        for claim in &item.claims {
            let _ =
                writeln!(text, "  [{}] {}", if claim.holds { "holds" } else { "does not hold" }, claim.text);
        }
        let _ = writeln!(text, "  {}\n", item.note);
    }
    let _ = writeln!(text, "all of it is on {index}");
    text
}

const STYLE: &str = "
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; }
section { border-top: 1px solid #8884; padding: 1rem 0 2rem; }
table { border-collapse: collapse; } td:first-child { white-space: nowrap; } td, th { text-align: left; vertical-align: top; padding: .25rem .9rem .25rem 0; }
svg { max-width: 100%; height: auto; background: white; border-radius: 6px; }
code { background: #8882; padding: .1rem .3rem; border-radius: 4px; overflow-wrap: anywhere; }
.good { color: #15803d; } .bad { color: #c2410c; } .id { opacity: .6; font-weight: normal; }
";

fn page(items: &[Item]) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>cotouch: reproduced</title>\n\
         <style>{STYLE}</style></head><body>\n<h1>What the two works print, and what comes out here</h1>\n"
    );
    contents(&mut page, items);
    for item in items {
        section(&mut page, item);
    }
    page.push_str("</body></html>\n");
    page
}

fn contents(page: &mut String, items: &[Item]) {
    page.push_str("<nav><table><tr><th>what</th><th>printed value or picture</th><th>sentences</th></tr>\n");
    for item in items {
        let holding = item.claims.iter().filter(|claim| claim.holds).count();
        let _ = writeln!(
            page,
            "<tr><td><a href=\"#{id}\">{id}</a>: {}</td><td>{}</td><td>{holding} of {} hold</td></tr>",
            escaped(item.title),
            mark(item.agrees, "agrees", "differs"),
            item.claims.len(),
            id = item.id,
        );
    }
    page.push_str("</table></nav>\n");
}

fn section(page: &mut String, item: &Item) {
    let _ = writeln!(
        page,
        "<section id=\"{id}\"><h2>{} <span class=\"id\">{id}</span></h2>",
        escaped(item.title),
        id = item.id
    );
    let _ = writeln!(page, "<p>{}</p><ul>", mark(item.agrees, "agrees", "differs"));
    for claim in &item.claims {
        let _ = writeln!(
            page,
            "<li>{}: {}</li>",
            escaped(&claim.text),
            mark(claim.holds, "holds", "does not hold")
        );
    }
    page.push_str("</ul>\n<table><tr><th></th><th>printed</th><th>here</th></tr>\n");
    for row in &item.rows {
        let cells: String = row.iter().map(|cell| format!("<td>{}</td>", escaped(cell))).collect();
        let _ = writeln!(page, "<tr>{cells}</tr>");
    }
    let _ = writeln!(page, "</table>\n<p>{}</p>", escaped(&item.note));
    if let Some(figure) = &item.figure {
        page.push_str(figure);
    }
    let names = item.files.iter().filter_map(|file| Path::new(file).file_name()?.to_str());
    let links: Vec<_> = names.map(|name| format!("<a href=\"{name}\">{name}</a>")).collect();
    let _ = writeln!(page, "<p>{}</p>\n<p>The same by hand:</p><ul>", links.join(", "));
    for command in &item.commands {
        let _ = writeln!(page, "<li><code>{}</code></li>", escaped(command));
    }
    page.push_str("</ul></section>\n");
}

fn mark(good: bool, yes: &str, no: &str) -> String {
    format!(
        "<strong class=\"{}\">{}</strong>",
        if good { "good" } else { "bad" },
        if good { yes } else { no }
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_exists_can_be_wanted() {
        assert_eq!(wanted(&[]).unwrap().len(), experiments::ALL.len());
        assert_eq!(wanted(&["fig8.4".to_owned()]).unwrap()[0].id, "fig8.4");
        let Err(Failure::Usage(error)) = wanted(&["fig9".to_owned()]) else { panic!("fig9 does not exist") };
        assert!(error.contains("fig8.1") && error.contains("table1.1"), "{error}");
    }

    #[test]
    fn a_page_shows_text_as_text() {
        assert_eq!(escaped("a < b & \"c\""), "a &lt; b &amp; &quot;c&quot;");
    }
}
