const data = JSON.parse(document.getElementById("data").textContent);
const slider = document.getElementById("gain"), play = document.getElementById("play");
const shown = document.getElementById("shown-gain"), cursor = document.getElementById("cursor");
const rates = [...document.querySelectorAll("[data-rate]")];
const dots = data.place.map((poles, k) => poles.map(() => {
  const dot = document.createElementNS("http://www.w3.org/2000/svg", "circle");
  dot.setAttribute("r", 22);
  dot.setAttribute("fill", data.colour[k]);
  dot.setAttribute("stroke", "#ffffff");
  dot.setAttribute("stroke-width", 6);
  document.getElementById("poles").append(dot);
  return dot;
}));
function show(frame) {
  data.place.forEach((poles, k) => poles.forEach((way, i) => {
    const at = way[frame], dot = dots[k][i];
    dot.style.display = at ? "" : "none";
    if (at) { dot.setAttribute("cx", at[0]); dot.setAttribute("cy", at[1]); }
  }));
  shown.textContent = data.gain[frame];
  rates.forEach((cell, k) => { cell.textContent = data.rate[k][frame]; });
  const x = data.cursor[frame];
  cursor.style.display = x === null || !data.height ? "none" : "";
  if (x !== null && data.height) {
    cursor.setAttribute("x1", x); cursor.setAttribute("x2", x);
    cursor.setAttribute("y1", data.height[0]); cursor.setAttribute("y2", data.height[1]);
  }
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
document.querySelectorAll("[hidden]").forEach((part) => { part.hidden = false; });
show(0);
