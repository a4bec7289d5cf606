"use strict";
// A map M(x, eps) x~ = r(x, eps) in floating-point numbers, and the page that plots its orbits.
// A polynomial is a list of terms [coefficient, power of each variable ..., power of eps].

function valueOf(terms, at) {
  let total = 0;
  for (const [coefficient, ...powers] of terms) {
    let term = coefficient;
    powers.forEach((power, k) => { for (let i = 0; i < power; i++) term *= at[k]; });
    total += term;
  }
  return total;
}

// Return the solution of (A | -b), or null if a pivot is zero or NaN.
function solve(rows) {
  const n = rows.length;
  for (let k = 0; k < n; k++) {
    let best = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(rows[i][k]) > Math.abs(rows[best][k])) best = i;
    [rows[k], rows[best]] = [rows[best], rows[k]];
    if (!(Math.abs(rows[k][k]) > 0)) return null;
    for (let i = k + 1; i < n; i++) {
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j <= n; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  const x = new Array(n);
  for (let k = n - 1; k >= 0; k--) {
    let remainder = -rows[k][n];
    for (let j = k + 1; j < n; j++) remainder -= rows[k][j] * x[j];
    x[k] = remainder / rows[k][k];
  }
  return x;
}

function step(rows, x, eps) {
  const at = [...x, eps];
  return solve(rows.map((row) => row.map((terms) => valueOf(terms, at))));
}

// Return the points of an orbit, fewer if it reaches an indeterminacy point or becomes too large.
function orbit(rows, start, eps, steps) {
  const points = [start];
  while (points.length <= steps) {
    const next = step(rows, points[points.length - 1], eps);
    if (next === null || !next.every((entry) => Math.abs(entry) < 1e100)) break;
    points.push(next);
  }
  return points;
}

function functionAt(f, x, eps) {
  const at = [...x, eps];
  return valueOf(f.numerator, at) / valueOf(f.denominator, at);
}

// Return a range that contains the first value and most others, as in other pictures: outliers are ignored.
function rangeOf(values) {
  const sorted = values.slice().sort((a, b) => a - b);
  const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
  const spread = at(0.9) - at(0.1) || Math.abs(at(0.5)) || 1;
  const low = Math.min(values[0], Math.max(sorted[0], at(0.1) - spread));
  const high = Math.max(values[0], Math.min(at(1), at(0.9) + spread));
  const margin = 0.06 * (high - low) || spread;
  return [low - margin, high + margin];
}

function ticksIn([low, high]) {
  const raw = (high - low) / 8, unit = 10 ** Math.floor(Math.log10(raw));
  const gap = [1, 2, 5, 10].map((m) => m * unit).find((m) => m >= raw);
  const ticks = [];
  for (let k = Math.ceil(low / gap); k * gap <= high; k++) ticks.push(k * gap);
  return ticks;
}

function show(data) {
  const element = (id) => document.getElementById("explore-" + id);
  const canvas = element("canvas"), pen = canvas.getContext("2d");
  const n = data.variables.length;
  const sliders = data.variables.map((_, k) => element("x" + k));
  const epsSlider = data.has_eps ? element("eps") : null;
  const axes = [element("horizontal"), element("vertical")];
  const bottom = 40, top = 20, right = 30;
  let left = 62, windows = null, points = [];
  const number = (value) => String(Number(value.toPrecision(6)));
  const coordinate = (k, axis) => (axis < n ? points[k][axis] : k);
  const chosen = () => axes.map((axis) => Number(axis.value));
  const eps = () => (epsSlider ? Number(epsSlider.value) : 0);
  const place = (value, side) => {
    const [low, high] = windows[side], share = (value - low) / (high - low);
    return side === 0 ? left + share * (canvas.width - left - right)
      : canvas.height - bottom - share * (canvas.height - bottom - top);
  };

  function fit() {
    windows = chosen().map((axis) => rangeOf(points.map((_, k) => coordinate(k, axis))));
  }

  function drawFrame() {
    const names = [...data.variables, "step"], [a, b] = chosen();
    pen.font = "17px sans-serif";
    left = 12 + Math.max(...[names[b], ...ticksIn(windows[1]).map(number)].map((label) => pen.measureText(label).width));
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.strokeStyle = "#888888";
    pen.strokeRect(left, top, canvas.width - left - right, canvas.height - bottom - top);
    pen.fillStyle = "#222222";
    pen.textBaseline = "middle";
    pen.textAlign = "center";
    for (const t of ticksIn(windows[0])) pen.fillText(number(t), place(t, 0), canvas.height - bottom + 14);
    pen.fillText(names[a], (left + canvas.width) / 2, canvas.height - 9);
    pen.textAlign = "right";
    for (const t of ticksIn(windows[1])) pen.fillText(number(t), left - 6, place(t, 1));
    pen.textAlign = "left";
    pen.fillText(names[b], 4, top - 10);
  }

  function draw() {
    points = orbit(data.rows, sliders.map((slider) => Number(slider.value)), eps(), Number(element("steps").value));
    if (windows === null) fit();
    drawFrame();
    const [a, b] = chosen();
    pen.save();
    pen.beginPath();
    pen.rect(left, top, canvas.width - left - right, canvas.height - bottom - top);
    pen.clip();
    const size = points.length > 1500 ? 1.6 : 2.4;
    pen.fillStyle = "#0b57d0";
    let outside = 0;
    points.forEach((_, k) => {
      const at = [coordinate(k, a), coordinate(k, b)];
      if (at.some((value, side) => value < windows[side][0] || value > windows[side][1])) outside++;
      else pen.fillRect(place(at[0], 0) - size / 2, place(at[1], 1) - size / 2, size, size);
    });
    pen.strokeStyle = "#d55e00";
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(place(coordinate(0, a), 0), place(coordinate(0, b), 1), 5, 0, 7);
    pen.stroke();
    pen.restore();
    sliders.forEach((slider, k) => { element("x" + k + "-value").textContent = number(Number(slider.value)); });
    if (epsSlider) element("eps-value").textContent = number(eps());
    const requested = Number(element("steps").value), taken = points.length - 1;
    element("steps-value").textContent = String(requested);
    element("status").textContent = `${taken} steps, ${outside} points outside the window`
      + (taken < requested ? `: the orbit ends after step ${taken}, at an indeterminacy point of the map or outside the range of numbers` : "");
    data.functions.forEach((f, row) => {
      const values = points.map((x) => functionAt(f, x, eps()));
      const most = Math.max(...values.map((value) => Math.abs(value - values[0])));
      element("first" + row).textContent = number(values[0]);
      element("last" + row).textContent = number(values[taken]);
      element("change" + row).textContent = most.toExponential(1);
    });
  }

  const refit = () => { windows = null; draw(); };
  for (const slider of [...sliders, epsSlider, element("steps")]) if (slider) slider.addEventListener("input", draw);
  for (const axis of axes) axis.addEventListener("change", refit);
  element("fit").addEventListener("click", refit);
  // a click or a drag in the picture moves the start, where both axes are variables
  const moved = (event) => {
    if (event.buttons !== 1) return;
    const box = canvas.getBoundingClientRect();
    const at = [(event.clientX - box.left) / box.width * canvas.width, (event.clientY - box.top) / box.height * canvas.height];
    const shares = [(at[0] - left) / (canvas.width - left - right),
      (canvas.height - bottom - at[1]) / (canvas.height - bottom - top)];
    chosen().forEach((axis, side) => {
      if (axis < n) sliders[axis].value = windows[side][0] + shares[side] * (windows[side][1] - windows[side][0]);
    });
    draw();
  };
  canvas.addEventListener("pointerdown", moved);
  canvas.addEventListener("pointermove", moved);
  draw();
}

if (typeof document === "undefined") module.exports = { orbit, solve, functionAt, rangeOf };
else document.addEventListener("DOMContentLoaded", () => show(JSON.parse(document.getElementById("explore-data").textContent)));
