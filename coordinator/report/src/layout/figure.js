"use strict";
// What a page's figures can do: values under the pointer or the arrow keys, a legend that hides, enlarging with zoom, and files of
// what is shown. Reads the numbers beside each figure, asks nothing of the network, sets every text as text.
(() => {
  const WIDE = 4000, HIGH = 2000, SVG = "http://www.w3.org/2000/svg";
  const make = (name, kind, text) => {
    const node = document.createElement(name);
    if (kind) node.className = kind;
    if (text !== undefined) node.textContent = text;
    return node;
  };
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const doubles = (text) => new Float64Array(bytes(text));
  const singles = (text) => new Float32Array(bytes(text));
  // As many digits as single precision has; none is lost that the page shows elsewhere.
  const number = (v) => {
    if (!Number.isFinite(v)) return "–";
    const text = Number(v.toPrecision(7));
    const shown = text !== 0 && (Math.abs(text) < 1e-4 || Math.abs(text) >= 1e7) ? text.toExponential() : String(text);
    return shown.replace("-", "−").replace("e−", "e-");
  };

  // An axis, whole or zoomed.
  class Axis {
    constructor(ends) { Object.assign(this, ends); this.whole = [this.at(this.lo), this.at(this.hi)]; [this.a, this.b] = this.whole; }
    at(v) { return this.log ? Math.log10(v) : v; }
    value(share) { const at = this.a + share * (this.b - this.a); return this.log ? 10 ** at : at; }
    share(v) { return (this.at(v) - this.a) / (this.b - this.a); }
    // A share of the whole axis.
    of(at) { return (at - this.whole[0]) / (this.whole[1] - this.whole[0]); }
    zoomed() { return this.a !== this.whole[0] || this.b !== this.whole[1]; }
    ticks() {
      const raw = (this.b - this.a) / 5, power = 10 ** Math.floor(Math.log10(raw));
      const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
      const list = [];
      for (let k = Math.ceil(this.a / step); k * step <= this.b; k += 1) list.push(k * step);
      const digits = Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
      return list.map((at) => [(at - this.a) / (this.b - this.a), this.log ? number(10 ** at) : at.toFixed(digits).replace("-", "−")]);
    }
  }

  class Series {
    constructor(data, axis, lists) {
      Object.assign(this, { key: data.key, band: data.band, long: "low" in data, drawn: data.drawn, axis });
      if (this.long) { this.lo = singles(data.low); this.hi = singles(data.high); return; }
      this.x = lists(data.x); this.lo = lists(data.lo); this.hi = data.band ? lists(data.hi) : this.lo;
      this.sorted = true;
      let last = -Infinity;
      for (const t of this.x) if (Number.isFinite(t)) { if (t < last) this.sorted = false; last = t; }
    }
    get length() { return this.lo.length; }
    // Where value k stands, in the axis' own scale.
    place(k) {
      if (!this.long) return this.axis.at(this.x[k]);
      const [from, to] = this.axis.whole;
      return from + (k + 0.5) / this.length * (to - from);
    }
    // The value next to a place.
    nearest(at) {
      if (this.long) {
        const [from, to] = this.axis.whole, n = this.length;
        const k = Math.min(n - 1, Math.max(0, Math.floor((at - from) / (to - from) * n)));
        for (let d = 0; d < n; d += 1) for (const j of [k - d, k + d]) if (Number.isFinite(this.lo[j])) return j;
        return null;
      }
      let best = null, least = Infinity;
      for (let k = 0; k < this.length; k += 1) {
        const far = Math.abs(this.place(k) - at);
        if (far < least && Number.isFinite(this.lo[k])) { least = far; best = k; }
      }
      return best;
    }
    text(k) {
      const [lo, hi] = [this.lo[k], this.hi[k]];
      return lo === hi ? number(lo) : `${number(lo)} to ${number(hi)}`;
    }
    // Its course inside the zoomed axis from one value to another, in the drawing of the whole one: smallest and largest per pixel.
    course(height, begin, end) {
      const n = this.length, [from, to] = this.axis.whole;
      const a = Math.max(this.axis.a, this.axis.at(begin)), b = Math.min(this.axis.b, this.axis.at(end));
      if (a >= b) return "";
      const first = Math.max(0, Math.floor((a - from) / (to - from) * n) - 1);
      const last = Math.min(n, Math.ceil((b - from) / (to - from) * n) + 1);
      const stride = Math.max(1, Math.ceil((last - first) / 1400));
      const upper = [], lower = [], line = [];
      for (let k = first; k < last; k += stride) {
        let lo = Infinity, hi = -Infinity;
        for (let j = k; j < Math.min(last, k + stride); j += 1) if (Number.isFinite(this.lo[j])) { lo = Math.min(lo, this.lo[j]); hi = Math.max(hi, this.hi[j]); }
        if (lo > hi) continue;
        const x = ((k + 0.5 * stride) / n * WIDE).toFixed(2);
        upper.push(`${x},${height(hi)}`); lower.unshift(`${x},${height(lo)}`);
        line.push(`${x},${height(line.length % 2 ? hi : lo)}`, `${x},${height(line.length % 2 ? lo : hi)}`);
      }
      return (this.band ? upper.concat(lower) : line).join(" ");
    }
  }

  class Plot {
    constructor(node, data, lists, figure) {
      this.node = node; this.figure = figure;
      this.frame = node.querySelector(".frame"); this.drawing = node.querySelector(".drawing");
      this.x = new Axis(data.x); this.y = new Axis(data.y);
      this.series = data.series.map((s) => new Series(s, this.x, lists));
      this.cross = make("div", "cross"); this.readout = make("div", "readout"); this.readout.setAttribute("role", "status");
      this.hide(); this.frame.append(this.cross, this.readout);
      this.frame.addEventListener("pointermove", (e) => figure.point(this, this.shareOf(e)));
      this.frame.addEventListener("pointerleave", () => figure.leave());
      this.frame.addEventListener("pointerdown", (e) => { this.pressed = this.shareOf(e); });
      this.frame.addEventListener("pointerup", (e) => this.released(this.shareOf(e)));
      this.originals = new Map();
    }
    shareOf(e) { const box = this.frame.getBoundingClientRect(); return Math.min(1, Math.max(0, (e.clientX - box.left) / box.width)); }
    shown() { return this.series.filter((s) => !this.figure.hidden.has(s.key)); }
    released(share) {
      const from = this.pressed;
      this.pressed = null;
      if (from === null || from === undefined || !this.figure.isLarge()) return;
      if (Math.abs(share - from) > 0.02) this.figure.zoom(...[from, share].sort((p, q) => p - q));
    }
    hide() { this.cross.hidden = true; this.readout.hidden = true; }
    // Shows the values next to a share of the axis.
    point(share) {
      const at = this.x.a + share * (this.x.b - this.x.a);
      const found = this.shown().map((s) => ({ s, k: s.nearest(at) })).filter(({ k }) => k !== null);
      // Curves that have several values at one place, as loci, are shown by the nearest one.
      const place = found.length ? found.map(({ s, k }) => s.place(k)).reduce((p, q) => (Math.abs(q - at) < Math.abs(p - at) ? q : p)) : at;
      const shownAt = (place - this.x.a) / (this.x.b - this.x.a);
      this.cross.hidden = this.readout.hidden = false;
      this.cross.style.left = `${100 * Math.min(1, Math.max(0, shownAt))}%`;
      this.readout.replaceChildren(make("div", "", `${this.x.label.replace(/ \[.*/, "")} ${number(this.x.log ? 10 ** place : place)}`));
      found.forEach(({ s, k }) => {
        const row = make("div"), sample = this.figure.samples[s.key];
        row.dataset.key = s.key; row.dataset.value = s.lo[k];
        row.append(make("i", `key ${sample.kind}`), document.createTextNode(`${sample.name} ${s.text(k)}`));
        this.readout.append(row);
      });
      const right = shownAt > 0.5;
      this.readout.style.left = right ? "auto" : `calc(${100 * shownAt}% + 10px)`;
      this.readout.style.right = right ? `calc(${100 * (1 - shownAt)}% + 10px)` : "auto";
    }
    // Shows a part of the axis: the drawing's window, finer courses, other ticks.
    show(a, b) {
      [this.x.a, this.x.b] = [a, b];
      const from = WIDE * this.x.of(a), to = WIDE * this.x.of(b);
      this.drawing.setAttribute("viewBox", `${from} 0 ${to - from} ${HIGH}`);
      const height = (v) => (HIGH * (1 - (this.y.at(v) - this.y.whole[0]) / (this.y.whole[1] - this.y.whole[0]))).toFixed(1);
      this.series.filter((s) => s.long).forEach((s) => this.refine(s, height));
      this.node.querySelectorAll(".frame > .x, .frame > .heading").forEach((tick) => { tick.hidden = this.x.zoomed(); });
      this.node.querySelectorAll(".frame > .x.zoomed").forEach((tick) => tick.remove());
      if (this.x.zoomed()) this.x.ticks().forEach(([share, text]) => {
        const tick = make("span", "x zoomed", text);
        tick.style.left = `${100 * share}%`;
        this.frame.append(tick);
      });
    }
    // Draws the courses of a long series in the zoomed window.
    refine(series, height) {
      const all = this.drawing.querySelectorAll(`g[data-key="${series.key}"] > ${series.band ? "polygon" : "polyline"}`);
      series.drawn.forEach(([k, begin, end]) => {
        const mark = all[k];
        if (!this.originals.has(mark)) this.originals.set(mark, mark.getAttribute("points"));
        mark.setAttribute("points", this.x.zoomed() ? series.course(height, begin, end) : this.originals.get(mark));
      });
    }
  }

  class Figure {
    constructor(node) {
      const data = JSON.parse(node.querySelector("script[type='application/json']").textContent), known = new Map();
      const lists = (k) => { if (!known.has(k)) known.set(k, doubles(data.numbers[k])); return known.get(k); };
      this.node = node; this.hidden = new Set();
      this.title = node.querySelector("strong").textContent;
      this.samples = [...node.querySelectorAll(".keys > span")].map((key) => ({ name: key.textContent, kind: key.firstElementChild.className.replace(/^key ?/, "") }));
      const plots = node.querySelectorAll(".plot");
      this.plots = data.plots.map((plot, k) => new Plot(plots[k], plot, lists, this));
      this.legend(); this.tools();
      node.addEventListener("keydown", (e) => this.keyed(e));
      node.addEventListener("blur", () => this.leave());
    }
    legend() {
      this.node.querySelectorAll(".keys > span").forEach((key) => {
        const k = Number(key.dataset.key), marks = this.node.querySelectorAll(`svg g[data-key="${k}"]`);
        if (!marks.length) return;
        const button = make("button");
        button.type = "button"; button.dataset.key = k;
        button.setAttribute("aria-pressed", "true");
        button.append(...key.childNodes);
        button.addEventListener("click", () => {
          const off = !this.hidden.delete(k);
          if (off) this.hidden.add(k);
          button.setAttribute("aria-pressed", String(!off));
          marks.forEach((mark) => mark.classList.toggle("off", off));
          this.leave();
        });
        key.replaceWith(button);
      });
    }
    tools() {
      const tools = make("div", "tools"), add = (text, says, act, kind) => {
        const button = make("button", kind, text);
        button.type = "button"; button.title = says; button.setAttribute("aria-label", `${says}: ${this.title}`);
        button.addEventListener("click", act);
        return button;
      };
      this.node.append(add("⤢", "Enlarge", () => (this.isLarge() ? this.dialog.close() : this.enlarge()), "enlarge"));
      tools.append(
        add("−", "Zoom out", () => this.zoom(-0.5, 1.5), "zoom"), add("+", "Zoom in", () => this.zoom(0.25, 0.75), "zoom"),
        add("←", "Earlier", () => this.zoom(-0.25, 0.75), "zoom"), add("→", "Later", () => this.zoom(0.25, 1.25), "zoom"),
        add("All", "The whole axis", () => this.whole(), "zoom"),
        add("CSV", "Numbers as CSV", () => this.save("csv", "text/csv", this.csv())),
        add("SVG", "Picture as SVG", () => this.save("svg", "image/svg+xml", this.svg().text)),
        add("PNG", "Picture as PNG", () => this.png()));
      this.node.append(tools);
    }
    isLarge() { return Boolean(this.dialog && this.dialog.open); }
    point(plot, share) {
      this.cursor = { plot, share };
      plot.point(share);
      // Plots over the same axis are read together.
      this.plots.filter((p) => p !== plot).forEach((p) => (p.x.lo === plot.x.lo && p.x.hi === plot.x.hi && this.stacked() ? p.point(share) : p.hide()));
    }
    stacked() { return this.plots.length === 2; }
    leave() { this.cursor = null; this.plots.forEach((p) => p.hide()); }
    keyed(e) {
      if (e.target !== this.node) return;
      if (e.key === "Enter" && !this.isLarge()) { e.preventDefault(); this.enlarge(); return; }
      const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
      if (!step) return;
      e.preventDefault();
      const plot = (this.cursor && this.cursor.plot) || this.plots[0], series = plot.shown()[0];
      if (!series) return;
      const share = this.cursor ? this.cursor.share : step > 0 ? -1 : 2;
      const at = plot.x.a + share * (plot.x.b - plot.x.a), places = [];
      for (let k = 0; k < series.length; k += 1) if (Number.isFinite(series.lo[k])) places.push(series.place(k));
      places.sort((p, q) => p - q);
      const near = 1e-9 * (plot.x.b - plot.x.a);
      const next = step > 0 ? places.find((p) => p > at + near) : places.reverse().find((p) => p < at - near);
      if (next !== undefined) this.point(plot, (next - plot.x.a) / (plot.x.b - plot.x.a));
    }
    enlarge() {
      const dialog = make("dialog", "large"), mark = document.createComment("figure");
      dialog.setAttribute("aria-label", this.title);
      this.node.replaceWith(mark);
      dialog.append(this.node);
      document.body.append(dialog);
      dialog.addEventListener("close", () => { this.whole(); this.leave(); mark.replaceWith(this.node); dialog.remove(); this.dialog = null; this.node.focus(); });
      dialog.addEventListener("click", (e) => { if (e.target === dialog) dialog.close(); });
      this.dialog = dialog;
      dialog.showModal();
      this.node.focus();
    }
    // Shows a part of what is shown, in shares of it.
    zoom(from, to) {
      this.leave();
      this.plots.forEach((p) => {
        const { a, b } = p.x, span = b - a, whole = p.x.whole[1] - p.x.whole[0];
        const wide = Math.min(whole, Math.max(1e-6 * whole, (to - from) * span));
        const low = Math.min(p.x.whole[1] - wide, Math.max(p.x.whole[0], a + from * span));
        p.show(...(wide >= whole ? p.x.whole : [low, low + wide]));
      });
    }
    whole() { this.plots.forEach((p) => p.show(...p.x.whole)); }
    save(kind, type, content) {
      const link = make("a");
      link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
      link.download = `${this.title.replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "")}.${kind}`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    }
    // A line per value: of a long series the smallest and the largest of each stretch that the page holds.
    csv() {
      const quote = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
      const lines = ["plot,series,x,low,high"];
      this.plots.forEach((p, n) => p.series.forEach((s) => {
        const name = quote(this.samples[s.key].name);
        for (let k = 0; k < s.length; k += 1) if (Number.isFinite(s.lo[k])) lines.push(`${n + 1},${name},${s.long && p.x.log ? 10 ** s.place(k) : s.long ? s.place(k) : s.x[k]},${s.lo[k]},${s.hi[k]}`);
      }));
      return lines.join("\n") + "\n";
    }
    // What the figure shows, as a picture of its own.
    svg() {
      const box = this.node.querySelector(".plots").getBoundingClientRect(), style = getComputedStyle(this.node);
      const escape = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");
      const ink = style.getPropertyValue("--ink"), parts = [];
      const text = (node, anchor, dx = 0) => {
        const r = node.getBoundingClientRect();
        if (!r.width || node.hidden) return;
        const x = (anchor === "end" ? r.right : r.left) - box.left + dx + 10;
        parts.push(`<text x="${x.toFixed(1)}" y="${(r.bottom - box.top + 52 - 4).toFixed(1)}" text-anchor="${anchor}" fill="${getComputedStyle(node).color}">${escape(node.textContent)}</text>`);
      };
      this.plots.forEach((p) => {
        const r = p.frame.getBoundingClientRect(), [x, y] = [r.left - box.left + 10, r.top - box.top + 52];
        const drawing = p.drawing.cloneNode(true), own = p.drawing.querySelectorAll("*");
        drawing.querySelectorAll("*").forEach((mark, k) => {
          const now = getComputedStyle(own[k]);
          if (now.display === "none") { mark.setAttribute("display", "none"); return; }
          if (!/^(path|poly|rect)/.test(mark.tagName)) return;
          mark.setAttribute("style", `fill:${now.fill};stroke:${now.stroke};stroke-width:${now.strokeWidth};stroke-dasharray:${now.strokeDasharray};stroke-linecap:${now.strokeLinecap};vector-effect:${now.vectorEffect}`);
        });
        Object.entries({ x, y, width: r.width, height: r.height }).forEach(([name, value]) => drawing.setAttribute(name, value.toFixed(1)));
        drawing.setAttribute("overflow", "hidden");
        parts.push(new XMLSerializer().serializeToString(drawing), `<path fill="none" stroke="${style.getPropertyValue("--muted")}" d="M${x} ${y}v${r.height}h${r.width}"/>`);
        p.node.querySelectorAll(".y-label, .heading, .frame > .x, .frame > .y").forEach((label) => text(label, "start"));
        text(p.node.querySelector(".x-label"), "end");
      });
      let at = 10;
      this.samples.forEach((sample, k) => {
        if (this.hidden.has(k)) return;
        const colour = getComputedStyle(this.node.querySelectorAll(".keys .key")[k]).getPropertyValue("--c") || ink;
        parts.push(`<rect x="${at}" y="31" width="14" height="4" fill="${colour}"/><text x="${at + 19}" y="37" fill="${ink}">${escape(sample.name)}</text>`);
        at += 34 + 6.4 * sample.name.length;
      });
      const width = Math.ceil(Math.max(box.width + 20, at)), height = Math.ceil(box.height + 62);
      const head = `<svg xmlns="${SVG}" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="Helvetica,Arial,sans-serif" font-size="12">`;
      const paper = `<rect width="100%" height="100%" fill="${style.getPropertyValue("--card")}"/><text x="10" y="18" font-size="14" font-weight="bold" fill="${ink}">${escape(this.title)}</text>`;
      return { text: `${head}${paper}${parts.join("")}</svg>`, width, height };
    }
    png() {
      const { text, width, height } = this.svg(), image = new Image();
      image.onload = () => {
        const canvas = make("canvas");
        canvas.width = 2 * width; canvas.height = 2 * height;
        canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
        canvas.toBlob((blob) => this.save("png", "image/png", blob));
      };
      image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
    }
  }

  // Figures come to life when they are about to be seen, so that a page of many opens at once.
  const alive = new WeakMap();
  const live = (node) => { if (!alive.has(node)) alive.set(node, new Figure(node)); };
  const seen = new IntersectionObserver((entries) => entries.forEach((e) => {
    if (e.isIntersecting) { seen.unobserve(e.target); live(e.target); }
  }), { rootMargin: "300px" });
  document.querySelectorAll("figure").forEach((node) => { if (node.querySelector("script[type='application/json']")) seen.observe(node); });
  document.addEventListener("focusin", (e) => { if (e.target.matches("figure")) live(e.target); });

  // A link of the table of contents opens what it leads to; print shows everything.
  const open = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const details = target && target.querySelector(":scope > details");
    if (details) details.open = true;
  };
  addEventListener("hashchange", open);
  document.querySelectorAll(".contents a").forEach((link) => link.addEventListener("click", () => setTimeout(open)));
  open();
  let closed = [];
  addEventListener("beforeprint", () => { closed = [...document.querySelectorAll("details:not([open])")]; closed.forEach((d) => { d.open = true; }); });
  addEventListener("afterprint", () => closed.forEach((d) => { d.open = false; }));
})();
