// SPDX-License-Identifier: MIT
// The inputs, outputs and curves of a node, as its device declares them (/api/nodes/N/points).

import {make, send} from './state.js';
import {addressOf, shortText} from './words.js';
import {watchObject} from './plots.js';

const titled = point => point.unit ? `${point.name} (${point.unit})` : point.name;
const isSet = (word, bit) => Math.floor(word / 2 ** bit) % 2 === 1;
const range = point => ({min: point.low ?? 0, max: point.high ?? Math.max(100, 2 * Math.abs(point.value))});
const limit = value => Math.abs(value) >= 1e7 ? value.toExponential(1).replace('+', '') : Math.abs(value) >= 1e4 ? `${Number((value / 1000).toPrecision(3))}k` : shortText(value);

/// A switch for each bit of an input.
function switches(point, word) {
  return point.bits.map((name, bit) => {
    const box = make('input', {type: 'checkbox', ariaLabel: `${point.name}: ${name}`, update: now => { box.checked = isSet(now.value, bit); }});
    box.onchange = () => send(`set ${word} ${point.object}.${bit} ${box.checked ? 1 : 0}`);
    return make('label', {className: 'switch'}, box, name);
  });
}

/// A lamp for each bit of a point: full or empty, red if it reports something wrong, and said.
function lamps(point, isShort = false) {
  return point.bits.map((name, bit) => {
    const lamp = make('span', {className: `lamp ${isSet(point.alarm ?? 0, bit) ? 'alarm' : ''}`, role: 'img', update: now => {
      lamp.classList.toggle('on', isSet(now.value, bit));
      lamp.ariaLabel = `${point.name}: ${name} ${isSet(now.value, bit) ? 'on' : 'off'}`;
    }});
    return make('span', {className: 'switch'}, lamp, isShort ? '' : name);
  });
}

function slider(point, word) {
  const set = value => send(`set ${word} ${point.object} ${value}`);
  const {min, max} = range(point);
  const bar = make('input', {type: 'range', ariaLabel: point.name, min, max, step: max - min > 10 ? 1 : 'any'});
  const field = make('input', {className: 'number', ariaLabel: `${point.name}, as a number`});
  bar.oninput = () => { field.value = bar.value; };
  bar.onchange = () => set(bar.value);
  field.onchange = () => { bar.value = field.value; set(field.value); };
  for (const input of [bar, field])
    input.update = now => { if (![bar, field].includes(document.activeElement)) input.value = input === bar ? now.value : shortText(now.value); };
  return [bar, field];
}

/// An axis with its limits, or a vessel; a mark is where the value is to go. Without a range it grows with the values.
function gauge(point) {
  let {min, max} = range(point);
  const share = value => 100 * Math.min(1, Math.max(0, (value - min) / (max - min)));
  const fill = make('i'), mark = make('b', {title: 'target'}), low = make('span'), high = make('span');
  const bar = make('div', {className: point.level ? 'level' : 'axis', role: 'meter', ariaLabel: point.name, update: now => {
    const most = Math.max(Math.abs(now.value), Math.abs(now.target ?? 0)) * 1.25;
    if (point.high === undefined && most > max) max = most;
    if (point.low === undefined && Math.min(now.value, now.target ?? 0) < 0) min = -max;
    Object.assign(bar, {ariaValueMin: min, ariaValueMax: max, ariaValueNow: now.value});
    const zero = share(0), at = share(now.value);
    if (point.level) fill.style.height = `${at}%`;
    else Object.assign(fill.style, {left: `${Math.min(zero, at)}%`, width: `${Math.abs(at - zero)}%`});
    mark.hidden = now.target === undefined;
    mark.style.left = `${share(now.target ?? 0)}%`;
    low.textContent = limit(min);
    high.textContent = limit(max);
  }}, fill, mark, low, high);
  const number = make('output', {className: 'number', update: now => { number.textContent = shortText(now.value); }});
  return [bar, number];
}

const isShort = point => point.bits.every(name => name.length < 3);

/// The main value and up to two rows of lamps, for a tile.
export function glance(points) {
  const numbers = points.filter(point => !point.bits), lit = points.filter(point => point.bits && point.kind !== 'curve');
  const main = ['output', 'curve', 'input'].map(kind => numbers.find(point => point.kind === kind)).find(Boolean);
  const named = ({name}) => make('span', {className: 'quiet', textContent: name});
  const parts = lit.slice(-2).map(point => [point, make('div', {className: 'lamps'}, named(point), ...lamps(point, isShort(point)))]);
  if (main) {
    const words = make('div', {update: now => {
      const going = now.target !== undefined && now.target !== now.value ? ` → ${shortText(now.target)}` : '';
      words.textContent = `${now.name} ${shortText(now.value)} ${now.unit ?? ''}${going}`;
    }});
    parts.unshift(...[gauge({...main, level: false})[0], words].map(part => [main, part]));
  }
  return parts.map(([point, part]) => marked(part, point));
}

/// show() finds the elements of a point.
function marked(part, point) {
  part.dataset.point = `${point.kind} ${point.object}`;
  return part;
}

/// Plots a number.
const plotter = (point, node) => make('button', {type: 'button', textContent: titled(point), title: `plot ${point.object}`,
  onclick: () => watchObject(node, {...addressOf(point), name: point.name, unit: point.unit})});

function row(point, node, word) {
  const label = point.bits ? make('span', {textContent: point.name, title: point.object}) : plotter(point, node);
  label.classList.add('name');
  const isInput = point.kind === 'input';
  if (point.bits) return [label, make('div', {className: 'bits'}, ...(isInput ? switches(point, word) : lamps(point)))];
  return [label, ...(isInput ? slider(point, word) : gauge(point))];
}

/// Elements for all points of a node; `show` puts new values into them.
export function controls(points, node, word) {
  const grid = make('div', {className: 'points'});
  for (const point of points.filter(each => each.kind !== 'curve')) {
    grid.append(...row(point, node, word).map(cell => marked(cell, point)));
  }
  const hasRow = point => points.some(each => each.kind !== 'curve' && each.object === point.object);
  const curves = points.filter(point => point.kind === 'curve' && !hasRow(point)).map(point => plotter(point, node));
  if (curves.length) grid.append(make('div', {className: 'curves'}, 'plot', ...curves));
  show(grid, points);
  return grid;
}

export function show(grid, points) {
  for (const point of points)
    for (const cell of grid.querySelectorAll(`[data-point="${point.kind} ${point.object}"]`))
      for (const part of [cell, ...cell.querySelectorAll('*')]) part.update?.(point);
}
