"""What pages are asked in their own language."""

# Every text against what lies behind it, by the formula of WCAG 2.1; the lowest ratio and where it is.
CONTRASTS = """(() => {
  const rgb = (text) => { const v = text.match(/[\\d.]+/g).map(Number); return text.startsWith("color(") ? [...v.slice(0, 3).map((x) => 255 * x), v[3] ?? 1] : [...v.slice(0, 3), v[3] ?? 1]; };
  const light = ([r, g, b]) => { const f = (v) => { v /= 255; return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; }; return 0.2126 * f(r) + 0.7152 * f(g) + 0.0722 * f(b); };
  const over = (top, below) => top.slice(0, 3).map((v, i) => v * top[3] + below[i] * (1 - top[3])).concat(1);
  const behind = (node) => { const layers = []; for (let n = node; n; n = n.parentElement) { const c = rgb(getComputedStyle(n).backgroundColor); layers.push(c); if (c[3] === 1) break; }
    return layers.reverse().reduce((below, top) => over(top, below), matchMedia("(prefers-color-scheme: dark)").matches ? [0, 0, 0, 1] : [255, 255, 255, 1]); };
  let worst = [99, ""];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode.parentElement, text = walk.currentNode.textContent.trim();
    if (!text || node.closest("script, style, svg") || !node.checkVisibility()) continue;
    const paper = behind(node), ink = over(rgb(getComputedStyle(node).color), paper), [a, b] = [light(ink), light(paper)];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < worst[0]) worst = [ratio, `${text.slice(0, 40)} (${node.tagName} ${node.className})`];
  }
  return worst;
})()"""

# Tables of which a part is out of sight; those of correlations are as large as they are.
CUT = """[...document.querySelectorAll(".scroll")].filter((s) => !s.querySelector(".correlation") && s.scrollWidth > s.clientWidth + 1)
  .map((s) => s.textContent.trim().slice(0, 60))"""

OPEN_ALL = "document.querySelectorAll('details').forEach((d) => { d.open = true; })"
