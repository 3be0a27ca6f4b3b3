// SPDX-License-Identifier: MIT
// The nodes; controls and the dictionary of the chosen node.

import {state, on, tell, element, make, svg, ask, commands, send, askWords, askNetwork, pathOf, pointsOf, prefix} from './state.js';
import {hex, nodeText, nodeHex, objectText, objectWord, valueText, driveState, stateClass} from './words.js';
import {List, choice} from './list.js';
import {watchObject} from './plots.js';
import {controls, show} from './device.js';

const kGutter = 26;
let view = 'control', nodes, dictionary = [], objects, search = '', panel, shownFaults = '', words = {faults: [], nmt: []};

const wordOf = node => prefix() + (node.node || `#${node.place}`);
const chosen = () => state.nodes.find(node => node.place === state.node);

// ---- Nodes

function summary(node) {
  const parts = [];
  if (node.statusword !== undefined) parts.push(driveState(node.statusword));
  if (node.emergency) parts.push(node.emergency.code ? `EMCY ${hex(node.emergency.code)} ${node.emergency.words}` : 'error is over');
  if (node.faults.length) parts.push(`${node.faults.length === 1 ? '1 fault' : `${node.faults.length} faults`} injected`);
  if (node.heard !== undefined) parts.push(`heard ${age(state.about.time - node.heard)}`);
  return parts.join(' · ') || node.device;
}
const age = seconds => seconds < 1 ? 'now' : seconds < 120 ? `${Math.floor(seconds)} s ago` : `${Math.floor(seconds / 60)} min ago`;

const nodeCells = node => [[nodeText(node.node), 'right'], [node.name, 'words strong'], [node.state, `pill words ${stateClass(node.state)}`],
  [nodeHex(node.node), 'quiet right'], [summary(node), `second words ${node.emergency?.code || node.faults.length ? 'bad' : 'quiet'}`]];

// ---- Wires: lines beside the rows of the nodes

let wires = [];

const here = end => end.network === state.network;

function drawWires() {
  const drawn = wires.filter(({from, to}) => here(from) && here(to)), middle = end => (end.place - 0.5) * nodes.height;
  const paths = drawn.map(({from, to}) => {
    const a = middle(from), b = middle(to), bulge = kGutter - Math.min(kGutter - 3, 6 + Math.abs(from.place - to.place) * 3);
    const path = svg('path', {d: `M${kGutter} ${a}C${bulge} ${a} ${bulge} ${b} ${kGutter - 5} ${b}m-4 -3l4 3l-4 3`});
    path.classList.toggle('chosen', [from.place, to.place].includes(state.node));
    return path;
  });
  nodes.beside(svg('svg', {class: 'wires', width: kGutter, height: state.nodes.length * nodes.height, 'aria-hidden': true}, ...paths));
  element('node-list').classList.toggle('wired', paths.length > 0);
}

/// The wires of a node in words; a click chooses the node at the other end.
function wireWords(node) {
  const isAt = end => here(end) && end.place === node.place, name = end => end.text.replace(/^[^:]*:/, '');
  return wires.filter(({from, to}) => isAt(from) || isAt(to)).map(({from, to}) => {
    const other = isAt(from) ? to : from;
    return button(isAt(from) ? `${name(from)} → ${to.text}` : `${name(to)} ← ${from.text}`, () => here(other) && nodes.pick(other.place), 'a wire');
  });
}

function chooseNode(node) {
  if (state.node === node.place && panel) return;
  state.node = node.place;
  element('node-title').textContent = `${nodeText(node.node)} ${node.name}`;
  build();
  tell('node', node);
}

// ---- Controls

/// update() sets the box by isOn() again.
function toggle(text, isOn, lineOf) {
  const box = make('input', {type: 'checkbox', checked: isOn(), isOn});
  box.onchange = () => send(lineOf(box.checked));
  return make('label', {className: 'switch'}, box, text);
}

const group = (...children) => make('div', {className: 'group'}, ...children);
const button = (text, call, title = '') => make('button', {type: 'button', textContent: text, onclick: call, title});

/// Other clients, wires and signals change values too.
async function followPoints() {
  const node = chosen(), grid = panel?.querySelector('.points');
  const {sent} = commands;  // values of before a command would take it back
  if (view !== 'control' || !node || !grid || sent !== commands.answered) return;
  const points = await pointsOf(node);
  if (node.place === state.node && sent === commands.sent) show(grid, points);
}

function faultForm(node) {
  const field = make('input', {className: 'number', ariaLabel: 'Fault', placeholder: 'response-late delay_ms=50'});
  field.setAttribute('list', 'fault-kinds');
  const form = make('form', {className: 'fault-form', autocomplete: 'off'}, field, make('button', {textContent: 'Inject'}),
    make('datalist', {id: 'fault-kinds'}, ...words.faults.map(({word, meaning}) => make('option', {value: word, label: meaning}))));
  form.onsubmit = event => {
    event.preventDefault();
    send(`fault ${wordOf(node)} ${field.value || field.placeholder}`);
  };
  return form;
}

async function buildControl(node) {
  const word = wordOf(node);
  panel.replaceChildren(
    group(toggle('power', () => chosen()?.state !== 'off', onOff => `power ${word} ${onOff ? 'on' : 'off'}`),
      ...words.nmt.map(({word: verb, meaning}) => button(verb, () => send(`nmt ${verb} ${word}`), meaning))),
    make('div', {className: 'points'}), group(...wireWords(node)),
    group(...node.incidents.map(name =>
      toggle(name, () => state.incidents.has(`${node.place} ${name}`), onOff => `incident ${word} ${name} ${onOff ? 'on' : 'off'}`))),
    make('div', {className: 'group', id: 'faults'}), faultForm(node));
  shownFaults = '';
  fillFaults(node);
  const points = await pointsOf(node);
  if (node.place === state.node) panel.querySelector('.points')?.replaceWith(controls(points, node, word));
}

function fillFaults(node) {
  const text = JSON.stringify(node.faults), host = element('faults');
  if (!host || text === shownFaults) return;
  shownFaults = text;
  host.replaceChildren(...node.faults.map(fault => toggle(`fault ${fault.number}: ${fault.fault}, ${fault.fired} ×`, () => true,
    onOff => onOff ? `fault ${wordOf(node)} ${fault.fault}` : `clear ${wordOf(node)} ${fault.number}`)));
}

// ---- Dictionary

const objectKey = object => object.index * 256 + object.sub;
const objectCells = object => [[objectText(object.index, object.sub), 'quiet'], [object.name, 'words'],
  [valueText(object.index, object.sub, object.value, object.type), 'right', `${object.value} (${object.type})`], [object.writable ? 'rw' : 'ro', 'quiet right']];

function filterObjects() {
  const words = search.toLowerCase().split(/\s+/);
  objects.items = dictionary.filter(object => {
    const text = `${objectText(object.index, object.sub)} ${object.name}`.toLowerCase();
    return words.every(word => text.includes(word));
  });
}

async function buildDictionary(node) {
  const field = make('input', {type: 'search', ariaLabel: 'Search in the dictionary', placeholder: 'search: 6040 or controlword', value: search});
  field.oninput = () => { search = field.value; filterObjects(); };
  const host = make('div', {className: 'list', id: 'objects-list', ariaLabel: 'Objects'});
  const value = make('input', {className: 'number', ariaLabel: 'Value', disabled: true}), label = make('label', {textContent: 'choose an object'});
  const form = make('form', {className: 'edit', autocomplete: 'off'}, label, value, make('button', {textContent: 'Set'}),
    button('Plot', () => watchObject(node, objects.item)));
  panel.replaceChildren(field, host, form);
  objects = new List(host, {kind: 'object', key: objectKey, cells: objectCells, edit: value,
    choose: object => {
      objects.item = object;
      label.textContent = `${objectText(object.index, object.sub)} ${object.name}`;
      Object.assign(value, {disabled: false, value: object.value});
    }});
  form.onsubmit = event => {
    event.preventDefault();
    if (objects.item) send(`set ${wordOf(node)} ${objectWord(objects.item)} ${value.value}`).then(reload);
  };
  await reload();
}

async function reload() {
  const node = chosen();
  if (view !== 'dictionary' || !node) return;
  dictionary = await askNetwork(`${pathOf(node)}/objects`).then(served => served.objects, () => []);
  filterObjects();
}

function build() {
  const node = chosen();
  panel = element('node-panel');
  if (node) (view === 'control' ? buildControl : buildDictionary)(node);
}

function update() {
  nodes.items = state.nodes;
  const node = chosen() ?? state.nodes.find(other => other.statusword !== undefined) ?? state.nodes[0];
  if (node && node.place !== state.node) nodes.pick(node.place);
  drawWires();
  if (!node || view !== 'control') return;
  fillFaults(node);
  for (const box of panel.querySelectorAll('input[type=checkbox]')) if (box.isOn) box.checked = box.isOn();
}

export function startPlant() {
  nodes = new List(element('node-list'), {kind: 'node', height: 38, key: node => node.place, cells: nodeCells, choose: chooseNode});
  choice(element('node-view'), {control: 'Control', dictionary: 'Dictionary'}, view, key => { view = key; build(); });
  on('so', update);
  on('restart', () => {
    state.node = null;
    ask('api/wires').then(served => { wires = served.wires; }).catch(() => {});
  });
  on('node', drawWires);
  setInterval(() => { if (!document.hidden) reload(); }, 1000);
  setInterval(() => { if (!document.hidden) followPoints(); }, 250);
  Promise.all([askWords(), ask('api/wires')]).then(([served, plant]) => {
    words = served;
    wires = plant.wires;
    build();
  });
}
