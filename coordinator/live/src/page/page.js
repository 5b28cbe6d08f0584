"use strict";
// Follows a run: takes views from the stream and draws the newest one. Every text from outside is set as text, never as markup.
(() => {
  const DRAW_EVERY = 250; // ms between two drawings of the charts
  const $ = (id) => document.getElementById(id);
  let view = null, points = [], elapsed = 0, heardAt = 0, isOver = false, drawnAt = 0, isDue = false;
  const charts = new Map();

  const time = (s) => {
    if (!(s >= 0)) return "";
    if (s < 60) return `${s < 10 ? s.toFixed(1) : Math.round(s)} s`;
    const m = Math.floor(s / 60);
    return m < 60 ? `${m} min ${Math.round(s - 60 * m)} s` : `${Math.floor(m / 60)} h ${m % 60} min`;
  };
  const number = (v, sd) => {
    if (v === null || !Number.isFinite(v)) return "–";
    if (v === 0) return "0";
    const size = Math.floor(Math.log10(Math.abs(v)));
    let digits = 5;
    if (sd > 0) digits = Math.min(12, Math.max(2, size - Math.floor(Math.log10(sd)) + 2));
    return size >= -4 && size < 7 ? v.toFixed(Math.min(12, Math.max(0, digits - 1 - size))) : v.toExponential(Math.min(12, digits - 1));
  };
  const count = (n) => n.toLocaleString("en").replaceAll(",", "\u202f");
  const text = (node, value) => { if (node.textContent !== value) node.textContent = value; };
  const element = (name, value, kind) => {
    const node = document.createElement(name);
    if (value !== undefined) node.textContent = value;
    if (kind) node.className = kind;
    return node;
  };
  // Rows of a table: cells are texts, or nodes; the first is the head of its row.
  const rows = (body, all) => {
    while (body.rows.length > all.length) body.deleteRow(-1);
    all.forEach(({ cells, kinds }, i) => {
      const row = body.rows[i] || body.insertRow();
      cells.forEach((cell, j) => {
        let td = row.cells[j];
        if (!td) {
          td = document.createElement(j === 0 ? "th" : "td");
          if (j === 0) td.scope = "row";
          row.append(td);
        }
        const kind = (kinds && kinds[j]) || "";
        if (td.className !== kind) td.className = kind;
        if (typeof cell === "object") cell.put(td); else text(td, cell);
      });
    });
  };
  const show = (id, is) => { $(id).hidden = !is; };

  // A chart of points against analyses: values, and a band where there is one.
  class Chart {
    constructor(parent, name, about) {
      this.name = name;
      this.about = about;
      const figure = element("figure");
      this.caption = element("figcaption", name);
      this.canvas = element("canvas");
      this.canvas.tabIndex = 0;
      this.canvas.setAttribute("role", "img");
      this.says = element("p", about);
      figure.append(this.caption, this.canvas, this.says);
      parent.append(figure);
      this.cursor = null;
      this.canvas.addEventListener("pointermove", (e) => this.point((e.clientX - this.canvas.getBoundingClientRect().left - this.left) / this.width));
      this.canvas.addEventListener("pointerleave", () => this.point(null));
      this.canvas.addEventListener("blur", () => this.point(null));
      this.canvas.addEventListener("keydown", (e) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
        if (!step || !this.data.length) return;
        e.preventDefault();
        const last = this.data.length - 1;
        const at = this.cursor === null ? last : this.nearest(this.cursor);
        this.point(this.share(this.data[Math.min(last, Math.max(0, at + step))].n));
      });
      this.data = [];
    }
    share(n) { return (n - this.from) / Math.max(1, this.to - this.from); }
    nearest(share) {
      let best = 0;
      this.data.forEach((p, i) => { if (Math.abs(this.share(p.n) - share) < Math.abs(this.share(this.data[best].n) - share)) best = i; });
      return best;
    }
    point(share) { this.cursor = share; this.draw(); }
    set(data, passes) { this.data = data; this.passes = passes; this.draw(); }
    draw() {
      const { canvas, data } = this, ratio = window.devicePixelRatio || 1;
      const w = canvas.clientWidth, h = canvas.clientHeight;
      if (!w || !data.length) return;
      if (canvas.width !== Math.round(w * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio); }
      const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim();
      const c = canvas.getContext("2d");
      c.setTransform(ratio, 0, 0, ratio, 0, 0);
      c.clearRect(0, 0, w, h);
      c.font = "12px system-ui, sans-serif";
      // The scale is that of the later half, and of all values.
      let low = Infinity, high = -Infinity;
      data.forEach((p, i) => {
        const all = 2 * i >= data.length ? [p.value, p.lo, p.hi] : [p.value];
        all.forEach((v) => { if (Number.isFinite(v) && v !== null) { low = Math.min(low, v); high = Math.max(high, v); } });
      });
      if (!(high >= low)) return;
      if (high === low) { const pad = Math.abs(high) * 0.05 || 1; low -= pad; high += pad; }
      const pad = 0.05 * (high - low);
      low -= pad; high += pad;
      const spread = (high - low) / 4;
      const labels = [low + pad, (low + high) / 2, high - pad];
      this.left = Math.max(...labels.map((v) => c.measureText(number(v, spread)).width)) + 8;
      this.width = Math.max(10, w - this.left - 8);
      const top = 6, bottom = h - 20;
      this.from = data[0].n; this.to = data[data.length - 1].n;
      const x = (n) => this.left + this.width * this.share(n), y = (v) => bottom - (bottom - top) * (v - low) / (high - low);
      c.fillStyle = colour("--muted"); c.strokeStyle = colour("--rule"); c.lineWidth = 1;
      c.textAlign = "right"; c.textBaseline = "middle";
      labels.forEach((v) => {
        c.fillText(number(v, spread), this.left - 6, y(v));
        c.beginPath(); c.moveTo(this.left, y(v)); c.lineTo(w - 8, y(v)); c.stroke();
      });
      c.textBaseline = "alphabetic"; c.textAlign = "left"; c.fillText(count(this.from), this.left, h - 5);
      c.textAlign = "right"; c.fillText(`${count(this.to)} analyses`, w - 8, h - 5);
      c.save(); c.beginPath(); c.rect(this.left, top, this.width, bottom - top); c.clip();
      this.passes.forEach((n) => { c.setLineDash([3, 3]); c.beginPath(); c.moveTo(x(n), top); c.lineTo(x(n), bottom); c.stroke(); c.setLineDash([]); });
      if (data[0].lo !== undefined) {
        c.fillStyle = colour("--band");
        c.beginPath();
        data.forEach((p) => c.lineTo(x(p.n), y(p.hi)));
        for (let i = data.length - 1; i >= 0; i--) c.lineTo(x(data[i].n), y(data[i].lo));
        c.fill();
      }
      c.strokeStyle = colour("--blue"); c.lineWidth = 1.75;
      c.beginPath();
      data.forEach((p) => c.lineTo(x(p.n), y(p.value)));
      c.stroke();
      if (data.length < 40) { c.fillStyle = colour("--blue"); data.forEach((p) => { c.beginPath(); c.arc(x(p.n), y(p.value), 2.5, 0, 7); c.fill(); }); }
      c.restore();
      const at = this.cursor === null ? null : data[this.nearest(this.cursor)];
      if (at) {
        c.strokeStyle = colour("--ink"); c.lineWidth = 1;
        c.beginPath(); c.moveTo(x(at.n), top); c.lineTo(x(at.n), bottom); c.stroke();
      }
      const told = at || data[data.length - 1];
      const band = told.lo === undefined ? "" : ` (${number(told.lo, (told.hi - told.lo) / 4)} … ${number(told.hi, (told.hi - told.lo) / 4)})`;
      const sd = told.lo === undefined ? 0 : (told.hi - told.lo) / 4;
      const says = `analysis ${count(told.n)}, pass ${told.pass}: ${number(told.value, sd)}${band}`;
      text(this.says, at ? says : this.about);
      canvas.setAttribute("aria-label", `${this.name}: ${says}`);
    }
  }
  const chart = (parent, key, name, about) => {
    if (!charts.has(key)) charts.set(key, new Chart($(parent), name, about));
    return charts.get(key);
  };

  const drawCharts = () => {
    const passes = points.filter((p, i) => i > 0 && p[1] !== points[i - 1][1]).map((p) => p[0]);
    const units = new Map(view.head.units);
    const shown = points.length ? points[points.length - 1][6].length : 0;
    for (let k = 0; k < shown; k++) {
      const { name } = view.parameters[k], unit = units.get(name);
      const data = points.filter((p) => p[6][k]).map((p) => ({ n: p[0], pass: p[1], value: p[6][k][0], lo: p[6][k][1], hi: p[6][k][2] }));
      chart("charts", `parameter ${k}`, unit ? `${name} (${unit})` : name, "estimate, and the band of ± 2 sd").set(data, passes);
    }
    const data = points.filter((p) => p[5] > 0 && p[4] !== null).map((p) => ({ n: p[0], pass: p[1], value: p[4] / p[5] }));
    show("nis-section", data.length > 0);
    if (data.length) chart("nis", "nis", "NIS per observation", "about 1 where model and noise are right").set(data, passes);
  };

  const draw = () => {
    isDue = false;
    if (!view || document.hidden) return;
    const { head, standing, fleet } = view;
    document.title = `${head.study} – ${standing.share === null ? head.command : Math.floor(100 * standing.share) + " %"}`;
    text($("study"), head.study);
    text($("about"), `starlings ${head.command} · ${head.model} · version ${head.version}`);
    const state = view.state === "ended" ? "ended early" : view.state;
    $("state").className = `badge ${view.state}`;
    text($("state"), state);
    text($("stage"), view.state === "running" ? [standing.stage, standing.says].filter(Boolean).join(": ") : "");
    const share = view.state === "finished" ? 1 : standing.share;
    if (share === null) $("share").removeAttribute("value"); else $("share").value = share;
    $("share").hidden = share === null && view.state !== "running";
    const left = view.state !== "running" || standing.left_s === null ? "" : `, about ${time(standing.left_s)} left`;
    const done = share === null ? "" : `${Math.floor(100 * share)} % · `;
    text($("times"), `${done}${time(elapsed)} so far${left} · ${count(standing.runs)} ${standing.counted}${head.command === "run" ? " in the analyses so far" : " so far"}`);
    const notice = view.state === "ended" ? view.ended : view.unreadable ? `The store cannot be read: ${view.unreadable}` : "";
    if (!isOver || view.state !== "finished") { show("notice", notice !== ""); text($("notice"), notice); }

    show("parameters-section", view.parameters.length > 0);
    const units = new Map(head.units);
    rows($("parameters"), view.parameters.map((p) => {
      const sd = (p.hi - p.lo) / 4;
      return { cells: [p.name, number(p.estimate, sd), number(p.lo, sd), number(p.hi, sd), units.get(p.name) || ""], kinds: ["", "number", "number", "number", ""] };
    }));
    const shown = points.length ? points[points.length - 1][6].length : 0;
    const rest = view.parameters.length - shown;
    text($("parameters-note"), view.at ? `After analysis ${count(view.analyses)} (pass ${view.at[0]}, step ${count(view.at[1])}).${rest > 0 && shown ? ` Drawn are the first ${shown}; the report draws all.` : ""}` : "");

    show("stages-section", view.stages.length > 0);
    rows($("stages"), view.stages.map((s, i) => {
      const next = view.stages[i + 1];
      const end = next ? next.from_s : elapsed, runs = (next ? next.runs : standing.runs) - s.runs;
      return { cells: [s.name, s.says, time(end - s.from_s), count(runs)], kinds: ["", "", "number", "number"] };
    }));

    show("fleet-section", fleet !== null);
    if (fleet) {
      const tiles = [["workers", count(fleet.workers)], ["slots busy", `${count(fleet.busy)} of ${count(fleet.slots)}`], ["runs in flight", count(fleet.busy + fleet.ahead)], ["runs queued", count(fleet.queued)], ["runs done", count(fleet.predictions)], ["set aside", count(fleet.aside)], ["workers lost", count(fleet.losses)]];
      tiles.forEach(([name, value], i) => {
        let tile = $("fleet").children[i];
        if (!tile) { tile = element("div"); tile.append(element("dt", name), element("dd")); $("fleet").append(tile); }
        text(tile.lastChild, value);
      });
      rows($("workers"), view.workers.map((w) => {
        const kind = { lost: "lost", "set aside": "aside" }[w.state] || "";
        const says = w.state + (w.at_s === null ? "" : ` at ${time(w.at_s)}`) + (w.why ? `: ${w.why}` : "");
        const load = { put: (td) => {
          if (w.state === "lost") return td.replaceChildren();
          let meter = td.firstElementChild;
          if (!meter) { meter = element("meter"); td.replaceChildren(meter); }
          meter.max = Math.max(1, w.slots);
          meter.value = Math.min(w.jobs, w.slots);
          meter.setAttribute("aria-label", `${Math.min(w.jobs, w.slots)} of ${w.slots} slots busy`);
        } };
        return { cells: [w.name, says, w.state === "lost" ? "–" : `${w.jobs} / ${w.slots}`, load], kinds: ["", kind, "number", ""] };
      }));
      text($("workers-note"), view.workers_left_out ? `${count(view.workers_left_out)} more workers are not listed.` : "");
    }
    show("failures-section", view.failures.length > 0);
    rows($("failures"), view.failures.map(([why, n]) => ({ cells: [why, count(n)], kinds: ["", "number"] })));

    show("events-section", view.events.length > 0);
    const key = view.events.length ? `${view.events[0].at_s} ${view.events.length}` : "";
    if ($("events").dataset.key !== key) {
      $("events").dataset.key = key;
      $("events").replaceChildren(...view.events.map((e) => {
        const item = element("li");
        item.append(element("time", time(e.at_s)), document.createTextNode(e.text));
        return item;
      }));
    }
    const now = performance.now();
    if (now - drawnAt >= DRAW_EVERY || isOver) { drawnAt = now; if (points.length) drawCharts(); }
  };
  const due = () => { if (!isDue) { isDue = true; requestAnimationFrame(draw); } };

  const over = () => {
    isOver = true;
    stream.close();
    draw();
    if (view.state !== "finished") return;
    const notice = $("notice");
    show("notice", true);
    if (!view.report) { text(notice, "The command is done; its terminal has the result."); return; }
    text(notice, "The run is finished. Its report follows.");
    // Navigating is no request of this page to elsewhere: the report comes from the same server, which waits for it.
    location.assign("report");
  };
  const stream = new EventSource("stream");
  stream.onmessage = (message) => {
    const sent = JSON.parse(message.data);
    points.length = sent.from;
    points.push(...sent.points);
    view = sent.view;
    elapsed = sent.elapsed_s;
    heardAt = performance.now();
    if (view.state === "running") due(); else over();
  };
  stream.onerror = () => {
    if (isOver) return;
    $("state").className = "badge lost";
    text($("state"), "connection lost");
    const notice = $("notice");
    show("notice", true);
    text(notice, `Nothing was heard since ${time(elapsed)}: the command was ended, or there is no network. What is shown is what was known then.`);
  };
  document.addEventListener("visibilitychange", due);
  window.addEventListener("resize", due);
})();
