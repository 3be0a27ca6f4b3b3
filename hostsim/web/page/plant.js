// SPDX-License-Identifier: MIT
// The nodes as tiles, the worst first; controls and the dictionary of the chosen node.

import {state, on, tell, element, make, ask, commands, send, askWords, askNetwork, pathOf, pointsOf, incidentsOf, prefix} from './state.js';
import {hex, nodeText, nodeHex, objectText, objectWord, valueText, driveState, kStates} from './words.js';
import {List, choice} from './list.js';
import {watchObject} from './plots.js';
import {controls, glance, show} from './device.js';

const kDense = 20;  // from so many nodes on each is a square
let view = 'control', nodes = [], tiles = new Map(), filter = '', points = [], letters = [];
let dictionary = [], objects, search = '', panel, shownFaults = '', words = {faults: [], nmt: []}, wires = [];

const wordOf = node => prefix() + (node.node || `#${node.place}`);
const chosen = () => nodes.find(node => node.place === state.node);
const isDense = () => nodes.length >= kDense;

// ---- Nodes

/// Why the module has not booted a node; '' = it has, or does not boot it.
const failureOf = node => state.failures.get(node.node) ?? letters[node.node] ?? '';

/// It has missed two heartbeats.
const isSilent = node => node.heartbeat_ms > 0 && state.about.time - (node.heard ?? 0) > node.heartbeat_ms / 500;

function stateOf(node) {
  if (!node.state) return 'missing';
  if (node.state === 'off') return node.state;
  return failureOf(node) && node.state !== 'operational' ? 'failed' : isSilent(node) ? 'silent' : node.state;
}

/// [text, class] of what is to be known about a node.
function remarks(node) {
  const found = failureOf(node) && node.state !== 'operational' ? [[failureOf(node), 'bad']] : [];
  if (!node.state) return found;
  if (isSilent(node) && node.state !== 'off') found.push([`heard ${age(state.about.time - (node.heard ?? 0))}`, 'bad']);
  if (node.emergency?.code) found.push([`EMCY ${hex(node.emergency.code)} ${node.emergency.words}`, 'bad']);
  for (const name of incidentsOf(node)) found.push([name, node.alarms.includes(name) ? 'bad' : 'wait']);
  if (node.faults.length) found.push([node.faults.length === 1 ? '1 fault injected' : `${node.faults.length} faults injected`, 'wait']);
  if (node.statusword !== undefined && node.state !== 'off') found.push([driveState(node.statusword), 'quiet']);
  return found;
}
const age = seconds => seconds < 1 ? 'now' : seconds < 120 ? `${Math.floor(seconds)} s ago` : `${Math.floor(seconds / 60)} min ago`;

const rank = node => 2 * Object.keys(kStates).indexOf(stateOf(node)) - (remarks(node).some(isBad) ? 1 : 0);

/// Nodes of the network file that are not in the plant have a tile too.
function arrange() {
  const statuses = state.registers.filter(({name}) => name === 'NODE_STATUS');
  letters = statuses.map(({value, words}) => value >> 8 >= 0x41 && value >> 8 <= 0x4F ? words : undefined);
  for (const node of state.nodes) if (node.state === 'operational') state.failures.delete(node.node);
  const ids = new Set([...state.failures.keys(), ...letters.keys()].filter(id => failureOf({node: id})));
  for (const {node} of state.nodes) ids.delete(node);
  const missing = Array.from(ids, id => ({place: -id, node: id, name: 'not in the plant'}));
  const ranked = [...state.nodes, ...missing].map(node => [rank(node), node]);
  nodes = ranked.sort(([a], [b]) => a - b).map(([, node]) => node);
}

function fillCounts() {
  const counts = Object.fromEntries(Object.keys(kStates).map(name => [name, 0]));
  for (const node of nodes) ++counts[stateOf(node)];
  if (!counts[filter]) filter = '';
  for (const button of element('counts').children) {
    const count = counts[button.value];
    button.hidden = !count;
    button.ariaPressed = button.value === filter;
    button.textContent = `${isDense() ? `${kStates[button.value][1]} · ` : ''}${count} ${button.value}`;
  }
}

const lines = said => said.map(([textContent, className]) => make('div', {className, textContent}));
const isBad = ([, kind]) => kind === 'bad';

/// A tile keeps its gauges, whose ranges grow with the values.
function fill(tile, node) {
  const name = stateOf(node), [kind, letter] = kStates[name], said = remarks(node), known = points[node.place] ?? [];
  const seen = JSON.stringify([node.node, node.name, name, said, isDense(), known.map(({kind, object}) => kind + object)]);
  tile.className = `tile ${kind} ${said.some(isBad) ? 'alarm' : ''} ${node.place === state.node ? 'chosen' : ''}`;
  tile.ariaSelected = node.place === state.node;
  if (tile.seen !== seen) {
    tile.seen = seen;
    tile.title = [`${nodeText(node.node)} ${node.name}`, name, ...said.map(([text]) => text)].join('\n');
    tile.ariaLabel = isDense() ? tile.title.replaceAll('\n', ', ') : null;
    tile.replaceChildren(...isDense() ? [make('b', {textContent: node.node || '–'}), make('span', {textContent: letter})]
      : [make('div', {className: 'head'}, make('b', {className: 'grow', textContent: `${nodeText(node.node)} ${node.name}`}),
        make('span', {className: `pill ${kind}`, textContent: name})), ...lines(said.filter(isBad)), ...glance(known),
      ...lines(said.filter(remark => !isBad(remark)))]);
  }
  show(tile, known);
}

function drawNodes() {
  const host = element('node-list'), shown = nodes.filter(node => !filter || stateOf(node) === filter), before = tiles;
  const made = place => make('div', {id: `node${place}`, role: 'option', onclick: () => choose(place)});
  tiles = new Map(shown.map(({place}) => [place, before.get(place) ?? made(place)]));
  host.classList.toggle('dense', isDense());
  for (const node of shown) fill(tiles.get(node.place), node);
  const order = [...tiles.values()];
  if (order.length !== host.children.length || order.some((tile, at) => host.children[at] !== tile)) host.replaceChildren(...order);
  host.setAttribute('aria-activedescendant', tiles.get(state.node)?.id ?? '');
}

function walk(event) {
  const host = element('node-list'), places = [...tiles.keys()], columns = getComputedStyle(host).gridTemplateColumns.split(' ').length;
  const by = {ArrowRight: 1, ArrowLeft: -1, ArrowDown: columns, ArrowUp: -columns, Home: -Infinity, End: Infinity}[event.key];
  if (!by || !places.length) return;
  event.preventDefault();
  choose(places[Math.min(places.length - 1, Math.max(0, places.indexOf(state.node) + by))]);
  tiles.get(state.node).scrollIntoView({block: 'nearest'});
}

function choose(place) {
  if (state.node === place && panel) return;
  state.node = place;
  drawNodes();
  about();
  build();
  tell('node', chosen());
}

function about() {
  const node = chosen();
  element('node-title').textContent = node ? `${nodeText(node.node)} ${node.name}` : 'No node';
  if (!node) return;
  const parts = [[[nodeHex(node.node), node.device, stateOf(node)].filter(Boolean).join(' · '), 'quiet'], ...remarks(node)];
  if (node.heard !== undefined && !isSilent(node)) parts.push([`heard ${age(state.about.time - node.heard)}`, 'quiet']);
  element('node-about').replaceChildren(...lines(parts));
}

/// The wires of a node in words; a click chooses the node at the other end.
function wireWords(node) {
  const here = end => end.network === state.network, isAt = end => here(end) && end.place === node.place;
  const name = end => end.text.replace(/^[^:]*:/, '');
  return wires.filter(({from, to}) => isAt(from) || isAt(to)).map(({from, to}) => {
    const other = isAt(from) ? to : from;
    return button(isAt(from) ? `${name(from)} → ${to.text}` : `${name(to)} ← ${from.text}`, () => here(other) && choose(other.place), 'a wire');
  });
}

// ---- Controls

/// update() sets the box by isOn() again.
function toggle(text, isOn, lineOf, className = '') {
  const box = make('input', {type: 'checkbox', checked: isOn(), isOn});
  box.onchange = () => send(lineOf(box.checked));
  return make('label', {className: `switch ${className}`}, box, text);
}

const group = (...children) => make('div', {className: 'group'}, ...children);
/// With a heading, if there is something below it.
const titled = (title, ...children) => children.length ? [make('h4', {textContent: title}), group(...children)] : [];
const button = (text, call, title = '') => make('button', {type: 'button', textContent: text, onclick: call, title});

/// Other clients, wires and signals change values too.
async function followPoints() {
  const node = chosen(), {sent} = commands;  // values of before a command would take it back
  if (!node || sent !== commands.answered || isDense() && view !== 'control') return;
  const found = [];
  if (isDense()) found[node.place] = await pointsOf(node);
  else found.push([], ...(await askNetwork('api/points').catch(() => ({nodes: []}))).nodes);
  if (sent !== commands.sent || node.place !== state.node) return;
  points = found;
  drawNodes();
  fillPoints(node);
}

/// Without power a node has none.
function fillPoints(node) {
  const grid = panel?.querySelector('.points'), now = points[node.place] ?? [], seen = now.map(({kind, object}) => kind + object).join();
  if (!grid) return;
  if (grid.seen === seen) show(grid, now);
  else grid.replaceWith(Object.assign(controls(now, node, wordOf(node)), {seen}));
}

function faultForm(node) {
  const kind = make('select', {ariaLabel: 'Kind of fault'}, new Option('choose a fault', ''), ...words.faults.map(({word}) => new Option(word)));
  const keys = make('input', {className: 'number', ariaLabel: 'Keys of the fault', placeholder: 'count=1'});
  const meaning = make('p', {className: 'quiet'});
  const form = make('form', {className: 'fault-form', autocomplete: 'off'}, kind, keys, make('button', {textContent: 'Inject'}), meaning);
  kind.onchange = () => { meaning.textContent = words.faults.find(({word}) => word === kind.value)?.meaning ?? ''; };
  form.onsubmit = event => {
    event.preventDefault();
    if (kind.value) send(`fault ${wordOf(node)} ${kind.value} ${keys.value}`.trim());
    else kind.focus();
  };
  return form;
}

function buildControl(node) {
  const word = wordOf(node), place = node.place;
  const incidents = node.incidents.map(name => toggle(name, () => state.incidents.has(`${place} ${name}`),
    onOff => `incident ${word} ${name} ${onOff ? 'on' : 'off'}`, node.alarms.includes(name) ? 'alarm' : ''));
  panel.replaceChildren(
    group(toggle('power', () => chosen()?.state !== 'off', onOff => `power ${word} ${onOff ? 'on' : 'off'}`),
      ...words.nmt.map(({word: verb, meaning}) => button(verb, () => send(`nmt ${verb} ${word}`), meaning))),
    make('div', {className: 'points'}), ...titled('Incidents', ...incidents), make('h4', {textContent: 'Fault on the bus'}),
    make('div', {className: 'group', id: 'faults'}), faultForm(node), ...titled('Wires', ...wireWords(node)));
  shownFaults = '';
  fillFaults(node);
  fillPoints(node);
  followPoints();
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
  [valueText(object.index, object.sub, object.value), 'right', `${object.value} (${object.type})`], [object.writable ? 'rw' : 'ro', 'quiet right']];

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
  if (node?.state) (view === 'control' ? buildControl : buildDictionary)(node);
  else panel.replaceChildren();
}

function update() {
  arrange();
  const node = chosen() ?? nodes.find(other => other.statusword !== undefined) ?? nodes[0];
  fillCounts();
  if (node && node.place !== state.node) choose(node.place);
  else drawNodes();
  about();
  if (!node?.state || view !== 'control') return;
  fillFaults(node);
  for (const box of panel.querySelectorAll('input[type=checkbox]')) if (box.isOn) box.checked = box.isOn();
}

export function startPlant() {
  element('node-list').onkeydown = walk;
  element('counts').append(...Object.entries(kStates).map(([name, [kind]]) => make('button', {className: `pill ${kind}`, value: name, hidden: true,
    onclick: () => { filter = filter === name ? '' : name; fillCounts(); drawNodes(); }})));
  choice(element('node-view'), {control: 'Control', dictionary: 'Dictionary'}, view, key => { view = key; build(); });
  on('so', update);
  on('restart', () => {
    state.node = null;
    points = [];
    ask('api/wires').then(served => { wires = served.wires; }).catch(() => {});
  });
  setInterval(() => { if (!document.hidden) reload(); }, 1000);
  setInterval(() => { if (!document.hidden) followPoints(); }, 250);
  Promise.all([askWords(), ask('api/wires')]).then(([served, plant]) => {
    words = served;
    wires = plant.wires;
    build();
  });
}
