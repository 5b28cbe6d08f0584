(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const slider = document.getElementById("gain"), play = document.getElementById("play");
const shown = document.getElementById("shown-gain");
const rates = [...document.querySelectorAll("[data-rate]")];
const make = (name, parent, kind) => {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  node.setAttribute("class", kind);
  parent.append(node);
  return node;
};
const plane = document.querySelector("#plane svg.drawing"), decay = document.querySelector("#decay svg.drawing");
// A dot is a stroke of no length with round ends: it stays round where the drawing stretches.
const dots = data.place.map((poles, k) => poles.map(() => {
  const group = make("g", plane, `c ${data.colour[k]}`);
  return [make("path", group, "dots rim"), make("path", group, "dots pole")];
}));
const cursor = make("path", make("g", decay, "c muted"), "line");
function show(frame) {
  data.place.forEach((poles, k) => poles.forEach((way, i) => {
    const at = way[frame];
    dots[k][i].forEach((dot) => dot.setAttribute("d", at ? `M${at[0]} ${at[1]}h0` : ""));
  }));
  shown.textContent = data.gain[frame];
  rates.forEach((cell, k) => { cell.textContent = data.rate[k][frame]; });
  const x = data.cursor[frame];
  cursor.setAttribute("d", x === null ? "" : `M${x} 0V2000`);
}
let timer = null;
function stop() { clearInterval(timer); timer = null; play.textContent = "Play"; }
play.addEventListener("click", () => {
  if (timer) { stop(); return; }
  if (+slider.value >= +slider.max) slider.value = 0;
  play.textContent = "Pause";
  timer = setInterval(() => {
    slider.value = +slider.value + 1;
    show(+slider.value);
    if (+slider.value >= +slider.max) stop();
  }, 80);
});
slider.max = data.gain.length - 1;
slider.addEventListener("input", () => { stop(); show(+slider.value); });
document.querySelectorAll(".live, .controls").forEach((part) => { part.hidden = false; });
show(0);
})();
