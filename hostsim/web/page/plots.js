// SPDX-License-Identifier: MIT
// Plots of watched objects, and a statusword's bits as lanes, with a common cursor.

import {state, on, tell, element, make, watch, pointsOf, prefix} from './state.js';
import {addressOf, objectText, objectWord, nodeText, shortText, kStatusBits} from './words.js';

const kLeft = 72, kRight = 62, kMostPoints = 6000, kMostWatched = 6, kMostKept = 16, kStatus = 0x6041;
let watched = [], status = null, kept = [], times = [], plot, lanes, stale = true, latest = 0, asked = 0, drawn = 0;

const key = object => `${object.node}:${objectWord(object).replace(/:0$/, '')}`;
/// Those of nodes chosen before are kept, as many as can be watched.
const all = () => [...watched, ...status ? [status] : [], ...kept];
const object = (node, given) => all().find(other => key(other) === key({...given, node})) ?? {...given, node, values: times.map(() => null)};
const color = (element, at) => getComputedStyle(element.children[at]).getPropertyValue('--c');

/// Objects with one unit, or with names that only a number tells apart, share an axis.
const scaleOf = object => object.unit || object.name.replace(/\d+/g, '');

function reset() {
  times = [];
  for (const object of all()) object.values = [];
}

function rewatch() {
  kept = kept.filter(other => !watched.includes(other) && other !== status).slice(0, kMostKept - watched.length - 1);
  watch(all().map(key));
  build();
}

export function watchObject(node, given) {
  if (!given || watched.includes(object(node.node, given))) return;
  watched.push(object(node.node, given));
  if (watched.length > kMostWatched) watched.shift();
  rewatch();
}

/// The curves of the device, without any its numbers, and the statusword of a drive; what others have chosen stays if it has none.
async function watchNode(node) {
  if (!node.node || !node.state) return;
  const numbers = (await pointsOf(node)).filter(point => !point.bits), before = all();
  const curves = numbers.filter(point => point.kind === 'curve');
  const found = (curves.length ? curves : numbers).slice(0, kMostWatched)
    .map(point => object(node.node, {...addressOf(point), name: point.name, unit: point.unit}));
  if (!found.length || (watched[0] && key(watched[0]) === key(found[0]))) return legend();
  watched = found;
  status = node.statusword === undefined ? null : object(node.node, {index: kStatus, sub: 0, name: 'Statusword'});
  kept = before;
  rewatch();
}

// ---- Values

function take(values) {
  for (const event of values) {
    const object = all().find(other => prefix() + key(other) === `${event.node}:${event.object}`);
    if (!object) continue;
    if (times.at(-1) !== event.time) {
      if (event.time < times.at(-1)) reset();
      times.push(event.time);
      for (const other of all()) other.values.push(other.values.at(-1) ?? null);
    }
    object.values[times.length - 1] = Number(event.value);
  }
  if (times.length > kMostPoints * 1.1)
    for (const array of [...all().map(object => object.values), times]) array.splice(0, times.length - kMostPoints);
  stale = true;
}

/// The plant's time; with a real clock it continues between two polls.
function present() {
  const passed = state.about?.clock === 'real' ? Math.min(1.5, (performance.now() - asked) / 1000) : 0;
  return Math.max(times.at(-1) ?? 0, latest + passed);
}

/// A value holds until it changes: the line extends to the present.
function data(objects) {
  const now = present();
  return [[...times, now], ...objects.map(object => [...object.values, object.values.at(-1) ?? null])];
}

// ---- Charts

const css = name => getComputedStyle(document.documentElement).getPropertyValue(name);
const font = size => `${size}px ${getComputedStyle(document.body).fontFamily}`;
const axis = properties =>
  ({stroke: css('--quiet'), font: font(11), grid: {stroke: css('--line'), width: 1}, ticks: {show: false}, ...properties});

function common(host) {
  return {width: host.clientWidth, height: host.clientHeight, legend: {show: false}, padding: [6, 8, 0, 0],
    cursor: {sync: {key: 'cbcan', scales: ['x', null]}, y: false, drag: {x: false, y: false}, points: {size: 6}},
    hooks: {setCursor: [chart => {
      if (chart.cursor.left >= 0 && chart.over.matches(':hover'))
        tell('cursor', state.cursor = chart.posToVal(chart.cursor.left, 'x'));
    }]}};
}

function build() {
  plot?.destroy();
  lanes?.destroy();
  plot = lanes = null;
  legend();
  element('lanes').hidden = !status;
  element('plots').hidden = !watched.length && !status;
  const host = element('plot'), scales = [...new Set(watched.map(scaleOf))];
  if (!window.uPlot || host.clientWidth === 0 || !watched.length) return;
  const axes = [axis({size: 22, space: 60, values: (_, marks) => marks.map(mark => `${mark} s`)}), ...scales.slice(0, 2).map(valueAxis)];
  const series = watched.map((object, at) => ({scale: scaleOf(object), stroke: color(element('legend'), at), width: 1.5,
    dash: /demand|target/i.test(object.name) ? [6, 4] : undefined, paths: uPlot.paths.stepped({align: 1}), points: {show: false}}));
  plot = new uPlot({...common(host), axes, series: [{}, ...series],
    scales: {x: {time: false, auto: false}, ...Object.fromEntries(scales.map(scale => [scale, {}]))}}, data(watched), host);
  if (status) buildLanes(scales.length > 1 ? kRight : 0);
  stale = true;
}

/// The first axis is at the left, the second at the right; the highest mark has the unit.
function valueAxis(scale, at) {
  const short = value => Math.abs(value) >= 10000 ? `${value / 1000}k` : String(value);
  const unit = watched.find(object => object.unit === scale)?.unit ?? '';
  const texts = marks => marks.map((mark, place) => place === marks.length - 1 ? `${short(mark)} ${unit}` : short(mark));
  return axis({scale, side: at ? 1 : 3, size: at ? kRight : kLeft, space: 26, values: (_, marks) => texts(marks),
    ...at ? {grid: {show: false}} : {}});
}

/// Each lane has a height of 1; the first one is at the top.
const base = at => kStatusBits.length - at - 0.95;

function buildLanes(right) {
  const host = element('lanes'), count = kStatusBits.length;
  const names = axis({size: kLeft, gap: 2, font: font(10), grid: {show: false},
    splits: () => kStatusBits.map((_, at) => base(at) + 0.3), values: () => kStatusBits.map(([, name]) => name)});
  const series = kStatusBits.map(([bit]) => {
    return {stroke: css('--control'), fill: css(bit === 3 || bit === 7 ? '--bad' : '--accent'), fillTo: (_, at) => base(at - 1), width: 1,
      paths: uPlot.paths.stepped({align: 1}), points: {show: false}};
  });
  lanes = new uPlot({...common(host), padding: [2, right + 8, 2, 0], axes: [{show: false}, names], series: [{}, ...series],
    scales: {x: {time: false, auto: false}, y: {range: () => [0, count]}}}, laneData(), host);
}

function laneData() {
  const [x, words] = data([status]);
  return [x, ...kStatusBits.map(([bit], at) => words.map(word => word === null ? null : base(at) + 0.65 * (word >> bit & 1)))];
}

function legend() {
  element('legend').replaceChildren(...watched.map((object, at) => {
    const name = `node ${nodeText(object.node)} ${objectText(object.index, object.sub)} ${object.name}`;
    const off = make('button', {textContent: '×', type: 'button', ariaLabel: `No longer plot ${name}`,
      onclick: () => { watched.splice(at, 1); rewatch(); }});
    const short = state.nodes.find(({place}) => place === state.node)?.node === object.node ? object.name : `${object.node} ${object.name}`;
    return make('span', {className: `line${at}`, title: name}, make('i'), short, make('b'), object.unit ?? '', off);
  }));
}

/// The values at the cursor, which moves to the time chosen elsewhere and keeps that time.
function showCursor() {
  let at = times.length - 1;
  if (state.cursor !== null) while (at > 0 && times[at] > state.cursor) --at;
  element('legend').querySelectorAll('b').forEach((field, number) => { field.textContent = shortText(watched[number]?.values[at] ?? '–'); });
  const charts = [plot, lanes].filter(Boolean);
  if (state.cursor === null || charts.some(chart => chart.over.matches(':hover'))) return;
  for (const chart of charts) chart.setCursor({left: chart.valToPos(state.cursor, 'x'), top: 10}, false, false);
}

function draw() {
  const now = performance.now();
  if (document.hidden || now - drawn < (stale ? 40 : 200)) return;
  stale = false;
  drawn = now;
  if (!plot && watched.length) build();
  if (!plot || element('hold').checked) return;
  const span = Number(element('span').value), max = present();
  for (const [chart, values] of [[plot, data(watched)], [lanes, status && laneData()]]) {
    if (!chart) continue;
    chart.batch(() => { chart.setData(values, false); chart.setScale('x', {min: Math.max(0, max - span), max: Math.max(2, max)}); });
  }
  showCursor();
}

export function startPlots() {
  on('values', take);
  on('so', () => { latest = state.about.time; asked = performance.now(); stale = true; });
  on('node', watchNode);
  on('restart', () => { status = null; watched = kept = []; reset(); build(); });
  on('cursor', showCursor);
  element('span').onchange = element('hold').onchange = () => { stale = true; };
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', build);
  new ResizeObserver(build).observe(element('plot'));
  (function frame() { draw(); requestAnimationFrame(frame); })();
}
