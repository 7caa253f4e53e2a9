// Style, controls and script of the page that compares pictures.
#pragma once

namespace render {

constexpr const char* comparison_style = R"(
html,body{height:100%;margin:0}
body{display:flex;flex-direction:column;font:14px/1.4 system-ui,sans-serif;background:#222;color:#ddd}
header{display:flex;flex-wrap:wrap;gap:.4rem 1.2rem;align-items:center;padding:.5rem .8rem;background:#333}
h1{font-size:1rem;margin:0}
button,select{font:inherit;color:inherit;background:#444;border:1px solid #666;border-radius:4px;padding:.1rem .5rem}
button[aria-pressed=true]{background:#1b6ca8;border-color:#1b6ca8}
output{display:inline-block;min-width:4.2em;text-align:center;font-variant-numeric:tabular-nums}
#stage{flex:1;position:relative;min-height:0;overflow:hidden;cursor:grab;touch-action:none}
#stage canvas{position:absolute;width:100%;height:100%}
#slider{position:absolute;top:0;bottom:0;width:24px;margin-left:-12px;cursor:ew-resize;touch-action:none;outline:none}
#slider::before{content:"";position:absolute;left:11px;top:0;bottom:0;width:2px;background:#fff;box-shadow:0 0 3px #000}
#slider::after{content:"\2194";position:absolute;left:-2px;top:50%;width:28px;height:28px;margin-top:-14px;
  border-radius:50%;background:#fff;color:#222;text-align:center;line-height:26px;box-shadow:0 0 4px #000}
#slider:focus-visible::after{background:#9ecbff}
.name{position:absolute;top:.6rem;padding:.2rem .6rem;border-radius:4px;background:#000a;pointer-events:none}
.name small{display:block;color:#bbb}
#name-left{left:.6rem}#name-right{right:.6rem;text-align:right}
footer{padding:.3rem .8rem;background:#333;font-size:12px;min-height:2.8em}
#values{font-variant-numeric:tabular-nums;color:#fff;white-space:pre-wrap}
kbd{background:#444;border-radius:3px;padding:0 .3em}
)";

constexpr const char* comparison_body = R"(<header><h1 id="title"></h1>
<label id="scene-label">scene <select id="scene"></select></label>
<label>left <select id="left"></select></label><label>right <select id="right"></select></label>
<button id="swap" title="x">swap</button>
<span>exposure <button id="darker" title="Shift+E">&minus;</button><output id="exposure"></output><button id="brighter" title="e">+</button></span>
<button id="errors" aria-pressed="false" title="m">errors</button>
<span>zoom <button id="out" title="-">&minus;</button><output id="zoom"></output><button id="in" title="+">+</button>
<button id="fit" title="f">fit</button> <button id="whole" title="1 screen pixel a pixel">1:1</button></span></header>
<div id="stage"><canvas id="canvas"></canvas>
<div id="slider" role="slider" tabindex="0" aria-label="where the left picture ends" aria-valuemin="0" aria-valuemax="100"></div>
<div class="name" id="name-left"></div><div class="name" id="name-right"></div></div>
<footer><div id="values">Move the pointer over the pictures to see values.</div>
Drag the slider, or <kbd>&larr;</kbd> <kbd>&rarr;</kbd>; drag the pictures, and zoom by the wheel or <kbd>+</kbd> <kbd>-</kbd>.
<kbd>1</kbd> to <kbd>9</kbd>: left picture; with <kbd>Shift</kbd>: right. <kbd>x</kbd> swap, <kbd>e</kbd> <kbd>Shift+E</kbd> exposure,
<kbd>m</kbd> errors, <kbd>s</kbd> next scene, <kbd>f</kbd> fit, <kbd>0</kbd> reset. Magenta: NaN or infinite.</footer>
)";

constexpr const char* comparison_script = R"SCRIPT(
"use strict";
const by = id => document.getElementById(id);
const data = JSON.parse(by("data").textContent);
const stage = by("stage"), canvas = by("canvas"), slider = by("slider");
const view = {scene: 0, left: 0, right: 0, split: 0.5, stops: 0, errors: false, scale: 1, x: 0, y: 0, fitted: true};

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}
const heat = bytesOf(data.heat);

// Values of 16-bit floats by their bits.
const values = new Float32Array(65536);
for (let i = 0; i < 65536; ++i) {
  const exponent = i >> 10 & 31, mantissa = i & 1023;
  const size = exponent === 31 ? (mantissa ? NaN : Infinity)
      : exponent ? (1 + mantissa / 1024) * 2 ** (exponent - 15) : mantissa * 2 ** -24;
  values[i] = i & 32768 ? -size : size;
}

const comparison = () => data.comparisons[view.scene];

function halvesOf(picture) {
  if (!picture.decoded) {
    const bytes = bytesOf(picture.halves);
    picture.decoded = new Uint16Array(bytes.length / 2);
    for (let i = 0; i < picture.decoded.length; ++i) picture.decoded[i] = bytes[2 * i] | bytes[2 * i + 1] << 8;
    picture.halves = null;
  }
  return picture.decoded;
}

// Bytes of sRGB by the bits of 16-bit floats, of the exposure.
let encoded = null, encodedStops = null;
function encodings() {
  if (encodedStops !== view.stops) {
    encoded = new Uint8ClampedArray(65536);
    const factor = 2 ** view.stops;
    for (let i = 0; i < 65536; ++i) {
      const v = Math.min(Math.max(values[i] * factor, 0), 1);
      encoded[i] = Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
    }
    encodedStops = view.stops;
  }
  return encoded;
}

// Mean over channels of |t - r| / (|r| + 0.01).
function relativeError(test, truth, i) {
  let sum = 0;
  for (let c = 0; c < 3; ++c) {
    const t = values[test[i + c]], r = values[truth[i + c]];
    sum += Math.abs(t - r) / (Math.abs(r) + 0.01);
  }
  return sum / 3;
}

const isFinitePixel = (halves, i) => (halves[i] & 31744) !== 31744 && (halves[i + 1] & 31744) !== 31744 && (halves[i + 2] & 31744) !== 31744;

// The picture, or the map of its errors, as a canvas of its own size.
function drawn(k) {
  const shown = comparison(), picture = shown.pictures[k], key = `${view.stops} ${view.errors}`;
  if (picture.key === key) return picture.canvas;
  const halves = halvesOf(picture), truth = halvesOf(shown.pictures[shown.pictures.length - 1]);
  const own = picture.canvas || document.createElement("canvas");
  own.width = shown.width;
  own.height = shown.height;
  const context = own.getContext("2d"), target = context.createImageData(shown.width, shown.height), to = target.data;
  const table = encodings(), factor = 255 * 2 ** view.stops;
  for (let i = 0, j = 0; i < halves.length; i += 3, j += 4) {
    to[j + 3] = 255;
    if (!isFinitePixel(halves, i) || (view.errors && !isFinitePixel(truth, i))) {
      to[j] = to[j + 2] = 255;
    } else if (view.errors) {
      const step = 3 * Math.min(Math.round(relativeError(halves, truth, i) * factor), 255);
      for (let c = 0; c < 3; ++c) to[j + c] = heat[step + c];
    } else {
      for (let c = 0; c < 3; ++c) to[j + c] = table[halves[i + c]];
    }
  }
  context.putImageData(target, 0, 0);
  picture.canvas = own;
  picture.key = key;
  return own;
}

function fit() {
  const shown = comparison();
  view.scale = Math.min(stage.clientWidth / shown.width, stage.clientHeight / shown.height);
  if (view.scale > 2) view.scale = Math.floor(view.scale);
  centre();
  view.fitted = true;
}

function centre() {
  view.x = (stage.clientWidth - comparison().width * view.scale) / 2;
  view.y = (stage.clientHeight - comparison().height * view.scale) / 2;
  view.fitted = false;
}

function zoomBy(factor, x = stage.clientWidth / 2, y = stage.clientHeight / 2) {
  const scale = Math.min(Math.max(view.scale * factor, 1 / 32), 128), change = scale / view.scale;
  view.x = x - (x - view.x) * change;
  view.y = y - (y - view.y) * change;
  view.scale = scale;
  view.fitted = false;
}

function describe(element, k) {
  const picture = comparison().pictures[k], note = document.createElement("small");
  note.textContent = picture.note;
  element.replaceChildren(view.errors ? `${picture.name}: relative error` : picture.name, note);
}

let isPlanned = false;
function update() {
  if (isPlanned) return;
  isPlanned = true;
  requestAnimationFrame(() => {
    isPlanned = false;
    paint();
  });
}

function paint() {
  if (view.fitted) fit();
  const shown = comparison(), ratio = window.devicePixelRatio || 1, context = canvas.getContext("2d");
  canvas.width = Math.round(stage.clientWidth * ratio);
  canvas.height = Math.round(stage.clientHeight * ratio);
  const cut = Math.round(view.split * canvas.width);
  for (const [k, from, to] of [[view.left, 0, cut], [view.right, cut, canvas.width]]) {
    context.save();
    context.beginPath();
    context.rect(from, 0, to - from, canvas.height);
    context.clip();
    context.imageSmoothingEnabled = view.scale * ratio < 1;
    context.drawImage(drawn(k), view.x * ratio, view.y * ratio, shown.width * view.scale * ratio, shown.height * view.scale * ratio);
    context.restore();
  }
  slider.style.left = `${100 * view.split}%`;
  slider.setAttribute("aria-valuenow", Math.round(100 * view.split));
  describe(by("name-left"), view.left);
  describe(by("name-right"), view.right);
  by("left").value = view.left;
  by("right").value = view.right;
  by("scene").value = view.scene;
  by("errors").setAttribute("aria-pressed", view.errors);
  by("exposure").textContent = `${view.stops > 0 ? "+" : ""}${view.stops} EV`;
  by("zoom").textContent = `${+(100 * view.scale).toPrecision(3)}%`;
}

function option(select, value, name) {
  const made = document.createElement("option");
  made.value = value;
  made.textContent = name;
  select.append(made);
}

// Shows the first picture beside the reference's neighbour, which is what is compared most.
function chooseScene(number) {
  view.scene = number;
  const pictures = comparison().pictures;
  for (const side of ["left", "right"]) {
    by(side).replaceChildren();
    pictures.forEach((picture, k) => option(by(side), k, `${k + 1} ${picture.name}`));
  }
  view.left = 0;
  view.right = Math.max(1, pictures.length - 2);
  view.fitted = true;
}

function showValues(event) {
  const shown = comparison(), box = stage.getBoundingClientRect();
  const x = Math.floor((event.clientX - box.left - view.x) / view.scale), y = Math.floor((event.clientY - box.top - view.y) / view.scale);
  if (x < 0 || y < 0 || x >= shown.width || y >= shown.height) return;
  const i = 3 * (y * shown.width + x), last = shown.pictures.length - 1, truth = halvesOf(shown.pictures[last]);
  const parts = [...new Set([view.left, view.right, last])].map(k => {
    const halves = halvesOf(shown.pictures[k]);
    const rgb = [0, 1, 2].map(c => values[halves[i + c]].toPrecision(3)).join(" ");
    return `${shown.pictures[k].name}: ${rgb}` + (k === last ? "" : ` (error ${(100 * relativeError(halves, truth, i)).toPrecision(3)}%)`);
  });
  by("values").textContent = `${x}, ${y}   ${parts.join("   ")}`;
}

const splitAt = x => Math.min(Math.max(x / stage.clientWidth, 0), 1);
let drag = null;
stage.addEventListener("pointerdown", event => {
  const isSlider = slider.contains(event.target);
  drag = {isSlider, x: event.clientX, y: event.clientY};
  stage.setPointerCapture(event.pointerId);
  if (isSlider) slider.focus();
  event.preventDefault();
});
stage.addEventListener("pointermove", event => {
  if (drag && drag.isSlider) {
    view.split = splitAt(event.clientX - stage.getBoundingClientRect().left);
  } else if (drag) {
    view.x += event.clientX - drag.x;
    view.y += event.clientY - drag.y;
    view.fitted = false;
    drag = {isSlider: false, x: event.clientX, y: event.clientY};
  }
  if (drag) update();
  showValues(event);
});
for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, () => drag = null);
stage.addEventListener("wheel", event => {
  const box = stage.getBoundingClientRect();
  zoomBy(2 ** (-Math.sign(event.deltaY) / 2), event.clientX - box.left, event.clientY - box.top);
  event.preventDefault();
  update();
}, {passive: false});

const actions = {
  swap: () => [view.left, view.right] = [view.right, view.left],
  darker: () => view.stops = Math.max(view.stops - 0.5, -20),
  brighter: () => view.stops = Math.min(view.stops + 0.5, 20),
  errors: () => view.errors = !view.errors,
  out: () => zoomBy(0.5),
  in: () => zoomBy(2),
  fit: () => fit(),
  whole: () => {
    view.scale = 1 / (window.devicePixelRatio || 1);
    centre();
  },
  next: () => chooseScene((view.scene + 1) % data.comparisons.length),
  reset: () => Object.assign(view, {split: 0.5, stops: 0, errors: false, fitted: true}),
  less: () => view.split = Math.max(view.split - 0.01, 0),
  more: () => view.split = Math.min(view.split + 0.01, 1),
};
const keys = {x: "swap", e: "brighter", "shift e": "darker", m: "errors", "-": "out", "+": "in", "=": "in", f: "fit", s: "next", 0: "reset",
              arrowleft: "less", arrowright: "more"};
function act(name) {
  actions[name]();
  update();
}
for (const name of Object.keys(actions))
  if (by(name)) by(name).addEventListener("click", () => act(name));
for (const side of ["left", "right"]) by(side).addEventListener("change", event => {
  view[side] = +event.target.value;
  event.target.blur();
  update();
});
by("scene").addEventListener("change", event => {
  chooseScene(+event.target.value);
  event.target.blur();
  update();
});
document.addEventListener("keydown", event => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") return;
  const digit = /^Digit([1-9])$/.exec(event.code), key = event.key.toLowerCase();
  const action = (event.shiftKey && keys[`shift ${key}`]) || keys[key];
  if (digit && +digit[1] <= comparison().pictures.length) {
    view[event.shiftKey ? "right" : "left"] = digit[1] - 1;
    update();
  } else if (action) {
    act(action);
    event.preventDefault();
  }
});

by("title").textContent = document.title;
data.comparisons.forEach((shown, k) => option(by("scene"), k, shown.scene));
by("scene-label").hidden = data.comparisons.length < 2;
chooseScene(0);
new ResizeObserver(update).observe(stage);
update();
)SCRIPT";

}  // namespace render
