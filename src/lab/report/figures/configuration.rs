//! The resolved configuration and the receipt: what it takes to do the run again.

use super::Figure;
use crate::lab::report::RunView;
use crate::lab::report::number::{count, escape};

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let receipt = view.receipt;
    let rows = [
        ("program", format!("dalean {}, arithmetic {}", view.timing.version, receipt.arithmetic)),
        ("data", view.data.clone()),
        ("data hash", receipt.data.hash.clone()),
        ("address", receipt.run.clone()),
        ("configuration hash", receipt.config.clone()),
        ("activation tables", receipt.tables.clone()),
        ("state hashes", format!("{}, one an epoch", count(receipt.epoch_hashes.len() as u64))),
        ("kernel, threads", format!("{}, {}", view.timing.kernel, view.timing.threads)),
        ("status", receipt.status.clone()),
    ];
    let rows = rows.map(|(name, value)| {
        format!("<tr><th scope=\"row\">{name}</th><td class=\"code\">{}</td></tr>", escape(&value))
    });
    let hashes: String = receipt
        .epoch_hashes
        .iter()
        .enumerate()
        .map(|(epoch, hash)| format!("{epoch:>4}  {}\n", escape(hash)))
        .collect();
    Some(Figure {
        id: "configuration",
        title: "Do it again",
        caption: "What went in, as resolved by the program, and what the receipt holds.".into(),
        body: format!(
            "<div class=\"scroll\"><table class=\"receipt\"><tbody>{}</tbody></table></div>\
             <details><summary>Resolved configuration</summary><pre>{}</pre></details>\
             <details><summary>State hash after each epoch</summary><pre>{hashes}</pre></details>",
            rows.concat(),
            escape(view.config)
        ),
        wide: true,
    })
}
