//! What tests of every page ask of it.

/// The page without what its scripts hold: they are ours, and the numbers of figures.
pub(crate) fn without_scripts(page: &str) -> String {
    let mut parts = page.split("<script");
    let mut text = parts.next().unwrap_or_default().to_owned();
    parts.for_each(|part| text += part.split_once("</script>").map_or("", |(_, rest)| rest));
    text
}

/// How many figures it has.
pub(crate) fn n_figure(page: &str) -> usize {
    page.matches("<figure tabindex=\"0\">").count()
}
