// SPDX-License-Identifier: MIT
// The nodes; controls and the dictionary of the chosen node.

import {state, on, tell, element, make, send, askNetwork, prefix} from './state.js';
import {hex, nodeText, nodeHex, objectText, objectWord, driveState, stateClass} from './words.js';
import {List, choice} from './list.js';
import {watchObject} from './plots.js';

const kInputs = {0x6000: [0, 255], 0x6401: [-32768, 32767], 0x9130: [0, 200000], 0x7130: [-32768, 32767], 0x6130: [0, 200000]};
const kFaults = ['response-never', 'response-late delay_ms=50', 'response-twice', 'abort code=0x06090030', 'silent',
  'heartbeat-stops', 'short-frame', 'response-other-toggle', 'emcy-storm', 'bus-off until_ms=500'];
const kNmt = {start: 'Start', preop: 'Pre-op', stop: 'Stop', 'reset-node': 'Reset', 'reset-comm': 'Reset comm.'};
let view = 'control', nodes, dictionary = [], objects, search = '', panel, shownFaults = '';

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

const nodeCells = node => [[nodeText(node.node), 'right'], [node.name, 'words'], [node.state, `pill words ${stateClass(node.state)}`],
  [nodeHex(node.node), 'quiet right'], [summary(node), `second words ${node.emergency?.code || node.faults.length ? 'bad' : 'quiet'}`]];

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
const button = (text, call) => make('button', {type: 'button', textContent: text, onclick: call});

function slider(node, object) {
  const [low, high] = kInputs[object.index];
  const line = value => `set ${wordOf(node)} ${objectWord(object)} ${value}`;
  const name = `${objectText(object.index, object.sub)} ${object.name}`;
  const range = make('input', {type: 'range', ariaLabel: name, min: low, max: high, step: high > 100000 ? 100 : 1, value: object.value});
  const field = make('input', {className: 'number', ariaLabel: `${name}, as a number`, value: object.value});
  for (const input of [range, field]) input.dataset.object = objectKey(object);
  range.oninput = () => { field.value = range.value; };
  range.onchange = () => send(line(range.value));
  field.onchange = () => { range.value = field.value; send(line(field.value)); };
  return [make('label', {textContent: name, title: name}), range, field];
}

const inputsOf = async node =>
  (await objectsOf(node, '?first=0x6000&last=0x9FFF')).filter(object => kInputs[object.index] && object.sub);

/// Other clients, wires and signals set inputs too; an input that is being edited is left unchanged.
async function followInputs() {
  const node = chosen();
  if (view !== 'control' || !node || !panel.querySelector('.inputs input')) return;
  for (const object of await inputsOf(node)) {
    const inputs = [...panel.querySelectorAll(`[data-object="${objectKey(object)}"]`)];
    if (!inputs.includes(document.activeElement)) inputs.forEach(input => { input.value = object.value; });
  }
}

function faultForm(node) {
  const field = make('input', {className: 'number', ariaLabel: 'Fault', placeholder: 'response-late delay_ms=50'});
  field.setAttribute('list', 'fault-kinds');
  const form = make('form', {className: 'fault-form', autocomplete: 'off'}, field, make('button', {textContent: 'Inject'}),
    make('datalist', {id: 'fault-kinds'}, ...kFaults.map(kind => make('option', {value: kind}))));
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
      ...Object.entries(kNmt).map(([verb, text]) => button(text, () => send(`nmt ${verb} ${word}`)))),
    make('div', {className: 'inputs'}),
    group(...node.incidents.map(name =>
      toggle(name, () => state.incidents.has(`${node.place} ${name}`), onOff => `incident ${word} ${name} ${onOff ? 'on' : 'off'}`))),
    make('div', {className: 'group', id: 'faults'}), faultForm(node));
  shownFaults = '';
  fillFaults(node);
  const inputs = await inputsOf(node);
  if (panel.querySelector('.inputs') && node.place === state.node)
    panel.querySelector('.inputs').replaceChildren(...inputs.flatMap(object => slider(node, object)));
}

function fillFaults(node) {
  const text = JSON.stringify(node.faults), host = element('faults');
  if (!host || text === shownFaults) return;
  shownFaults = text;
  host.replaceChildren(...node.faults.map(fault => toggle(`fault ${fault.number}: ${fault.fault}, ${fault.fired} ×`, () => true,
    onOff => onOff ? `fault ${wordOf(node)} ${fault.fault}` : `clear ${wordOf(node)} ${fault.number}`)));
}

// ---- Dictionary

async function objectsOf(node, part = '') {
  const word = node.node ? String(node.node) : `%23${node.place}`;
  try { return (await askNetwork(`api/nodes/${word}/objects${part}`)).objects; } catch { return []; }
}

const objectKey = object => object.index * 256 + object.sub;
const objectCells = object => [[objectText(object.index, object.sub), 'quiet'], [object.name, 'words'],
  [object.value, 'right', `${object.value} (${object.type})`], [object.writable ? 'rw' : 'ro', 'quiet right']];

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
  const host = make('div', {className: 'list', ariaLabel: 'Objects'});
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
  dictionary = await objectsOf(node);
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
  if (!node || view !== 'control') return;
  fillFaults(node);
  for (const box of panel.querySelectorAll('input[type=checkbox]')) box.checked = box.isOn();
}

export function startPlant() {
  nodes = new List(element('node-list'), {kind: 'node', height: 38, key: node => node.place, cells: nodeCells, choose: chooseNode});
  choice(element('node-view'), {control: 'Control', dictionary: 'Dictionary'}, view, key => { view = key; build(); });
  on('so', update);
  on('restart', () => { state.node = null; });
  setInterval(() => { if (!document.hidden) { reload(); followInputs(); } }, 1000);
}
