// SPDX-License-Identifier: MIT
// The registers with their names and meanings; changed ones are highlighted for kLit ms; a click prepares a write.

import {state, on, element, send, prefix} from './state.js';
import {hex, valueText, kServices} from './words.js';
import {List, choice} from './list.js';

const kLit = 2000, kResults = {0: 'done', 4: 'failed', 0xCA0E: 'busy'};
const views = {
  window: {text: 'R3700', has: at => at >= 3700 && at < 3770},
  scanner: {text: 'Scanner', has: (_, name) => /^(OUT|IN)_/.test(name)},
  process: {text: 'Process data', has: (_, name) => /^(INPUTS|OUTPUTS)$/.test(name)},
  network: {text: 'Network', has: (at, name, item) =>
    /^(STATUS|STATUS_CHANGES|NODE_COUNTS|FIRST_NOT_RUNNING|HEARD|CONFIGURED|RUNNING|EMCY|LOST|NODE_STATUS)$/.test(name) &&
    (item.value !== 0 || at === first(name))},
};
const notations = {3700: number => `R${number}`, 43701: number => `4${String(number + 1).padStart(4, '0')}`,
  403701: number => `4${String(number + 1).padStart(5, '0')}`};
let view = 'window', unfolded = false, notation = '3700', list, seen = new Map(), changed = new Map();

const numbered = item => notations[notation](item.register);

/// Registers with a bit for each node: bit n mod 16 of register n div 16.
const isMap = name => /^(HEARD|CONFIGURED|RUNNING|EMCY|LOST)$/.test(name);
function nodesOf({register, name, value}) {
  const ids = Array.from({length: 16}, (_, bit) => 16 * (register - first(name)) + bit).filter((_, bit) => value >> bit & 1);
  const ends = ids.filter(id => !ids.includes(id - 1)).map(id => [id, ids.find(last => last >= id && !ids.includes(last + 1))]);
  return ids.length ? `${ids.length > 1 ? 'nodes' : 'node'} ${ends.map(([id, last]) => id === last ? id : `${id}..${last}`).join(' ')}` : '';
}

/// The meaning of one of a request's words, which depends on the others.
function meaning(item, all) {
  const at = name => all.find(other => other.name === item.name.replace(/(OUT_|IN_|)[A-Z_]+$/, `$1${name}`))?.value;
  const value = item.value;
  if (item.register === 3700 && kResults[value]) return kResults[value];
  if (item.register === 3706) return resultOf(state.ended.at(-1));
  if (item.mapped) return item.mapped.replaceAll('node ', '');
  if (/COMMAND$/.test(item.name)) return kServices[value] ?? '';
  if (item.words) return item.words;
  if (isMap(item.name)) return nodesOf(item);
  if (/NODE_ID$/.test(item.name)) return state.nodes.find(node => node.node === value)?.name ?? (value ? '' : 'own node');
  if (/OBJECT_INDEX$/.test(item.name)) return at('NODE_ID') === undefined ? hex(value) : objectName(at('NODE_ID'), value);
  if (/DATA_SIZE$/.test(item.name)) return 'bytes';
  return '';
}

/// What the last transaction has written to the data words.
function resultOf(ended) {
  if (!ended || ended.result === 4) return ended?.outcome ?? '';
  return ended.ok && ended.value !== '' ? `= ${valueText(ended.index, ended.sub, ended.value)}` : '';
}

const objectName = (node, index) => state.ended.findLast(ended => ended.node === node && ended.index === index)?.name ?? '';

const first = name => state.registers.find(item => item.name === name).register;

/// DATA, INPUTS and the like have several registers, which are numbered.
function nameOf(item) {
  const place = item.register - first(item.name);
  if (item.name === 'NODE_STATUS') return place ? `node ${place}` : 'module';
  return /DATA$|PUTS$/.test(item.name) ? `${item.name.replace('PUTS', '')} ${place}` : item.name;
}

/// In the window, words at the end that no request uses are one row until it is chosen.
function folded(items) {
  if (view !== 'window' || unfolded) return items;
  const at = name => items.find(item => item.name === name)?.value ?? 0;
  const used = 6 + Math.max(2, Math.ceil(Math.min(at('DATA_SIZE'), 128) / 2));
  const end = Math.max(used, 1 + items.findLastIndex(item => item.value !== 0 || changed.has(item.register)));
  const rest = items.slice(end);
  return rest.length < 3 ? items : [...items.slice(0, end), {...rest[0], fold: rest.length}];
}

function cells(item) {
  if (item.fold) return [[numbered(item), 'quiet'], ['0', 'right'], ['…', 'quiet'], [`${item.fold} words of 0`, 'words quiet'], ['show them', 'words quiet']];
  const digits = item.value.toString(16).toUpperCase().padStart(4, '0');
  return [[numbered(item), 'quiet'], [String(item.value), 'right'], [`${digits}h`, 'quiet'], [nameOf(item), 'words quiet'],
    [meaning(item, state.registers), 'words', item.words ?? '']];
}

function update() {
  const now = performance.now();
  for (const {register, value} of state.registers) {
    if (seen.has(register) && seen.get(register) !== value) changed.set(register, now);
    seen.set(register, value);
  }
  for (const [register, when] of changed) if (now - when > kLit) changed.delete(register);
  list.items = folded(state.registers.filter(item => views[view].has(item.register, item.name, item)));
}

function choose(item) {
  if (item.fold) {
    unfolded = true;
    update();
  }
  const form = element('register-form');
  form.register = item.register;
  form.querySelector('label').textContent = `${numbered(item)} ${item.name}`;
  element('register-value').value = item.value;
}

function write(event) {
  event.preventDefault();
  const words = element('register-value').value.trim().split(/[\s,]+/).filter(Boolean);
  if (words.length) send(`write ${prefix()}${event.target.register ?? 3700} ${words.join(' ')}`);
}

function renumber() {
  const names = Object.keys(notations);
  notation = names[(names.indexOf(notation) + 1) % names.length];
  element('notation').textContent = notation;
  list.draw();
}

function unfold() {
  const hidden = element('registers').hidden = !element('registers').hidden;
  element('more-registers').ariaExpanded = !hidden;
  document.body.classList.toggle('registers', !hidden);
}

export function startRegisters() {
  element('more-registers').onclick = unfold;
  list = new List(element('register-list'), {kind: 'register', key: item => item.register, cells, choose,
    edit: element('register-value'), mark: item => changed.has(item.register) ? 'lit' : ''});
  choice(element('register-view'), Object.fromEntries(Object.entries(views).map(([key, {text}]) => [key, text])), view,
    key => { view = key; unfolded = false; element('register-list').scrollTop = 0; update(); });
  element('notation').textContent = notation;
  element('notation').onclick = renumber;
  element('register-form').onsubmit = write;
  on('so', update);
  on('restart', () => { seen.clear(); changed.clear(); });
}
