//! Every test that `docs/errata.md` names is there.

use std::path::Path;

#[test]
fn every_test_of_the_page_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/errata.md")).unwrap();
    let mut found = 0;
    for name in page.split('`').filter(|part| part.contains(".rs::")) {
        let (file, function) = name.split_once("::").unwrap();
        let text = std::fs::read_to_string(root.join(file));
        let text = text.unwrap_or_else(|error| panic!("{name}: {error}"));
        let test = format!("#[test]\n{}fn {function}()", indent(&text, function));
        assert!(text.contains(&test), "no test {name}");
        found += 1;
    }
    assert!(found > 40, "the page names {found} tests only");
}

/// The indentation of the line that begins the function.
fn indent<'a>(text: &'a str, function: &str) -> &'a str {
    let start = text.find(&format!("fn {function}()")).unwrap_or(0);
    let line = text[..start].rfind('\n').map_or(0, |end| end + 1);
    &text[line..start]
}
