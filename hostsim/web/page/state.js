// SPDX-License-Identifier: MIT
// The page's copy of the simulator's state: the stream of events, and the results of requests. Its size is bounded.

import {server} from './server.js';

const kMostEnded = 1000, kMostNotes = 200, kMostRecent = 2000, kMostPending = 4000;

export const state = {
  about: null, nodes: [], registers: [],
  ended: [], recent: [],      // completed transactions, and all events; the oldest first
  notes: [], advice: [],      // events of the kinds advice and boot; the counts of /api/advice
  failures: new Map(),        // why nodes have not been booted, by their ID
  incidents: new Set(),       // "16 overcurrent", as switched by commands
  missed: 0,                  // events that were left out
  network: 1, node: null,     // the chosen ones
  transaction: null,          // the number of the chosen one
  cursor: null,               // a time in seconds, common to plots, transactions and frames
};

const listeners = {};
export function on(topic, call) { (listeners[topic] ??= []).push(call); }
export function tell(topic, what) { for (const call of listeners[topic] ?? []) call(what); }
export const element = id => document.getElementById(id);
export function make(name, properties = {}, ...children) {
  const node = Object.assign(document.createElement(name), properties);
  node.append(...children);
  return node;
}
export function svg(name, attributes, ...children) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}
export const prefix = () => state.network === 1 ? '' : `${state.network}/`;

/// Of a node, in the HTTP interface.
export const pathOf = node => `api/nodes/${node.node || `%23${node.place}`}`;

/// The incidents of a node that have been switched on.
export const incidentsOf = node => node.incidents.filter(name => state.incidents.has(`${node.place} ${name}`));

/// Inputs, outputs and curves of a node.
export const pointsOf = node => askNetwork(`${pathOf(node)}/points`).then(({points}) => points).catch(() => []);

/// The item nearest to the cursor, if that is within a second.
export function nearest(items, timeOf) {
  const distance = item => Math.abs(timeOf(item) - state.cursor);
  const best = state.cursor === null ? null : items.reduce((one, other) => one && distance(one) <= distance(other) ? one : other, null);
  return best && distance(best) < 1 ? best : null;
}

function keep(list, item, most) {
  list.push(item);
  if (list.length > most * 1.1) list.splice(0, list.length - most);
}

export async function ask(path) {
  const response = await server.request(path);
  const json = await response.json();
  if (!response.ok) throw new Error(json.error);
  return json;
}
export const askNetwork = path => ask(path + (path.includes('?') ? '&' : '?') + `network=${state.network}`);

let words;
/// The words of commands and events, from /api/words.
export const askWords = () => words ??= ask('api/words').catch(() => ({faults: [], nmt: [], kinds: []}));

// ---- Events

let source, pending = [], last = 0, watched = '', scheduled = false, changed = false;
let whole = 0, gap = false;  // from event number `whole` on none has been left out

function take(event) {
  if (event.number <= last) forget();  // the program has been restarted
  last = event.number;
  if (gap) whole = last;
  gap = false;
  if (event.network && event.network !== state.network) return;
  keep(state.recent, event, kMostRecent);
  if (event.kind === 'ended') keep(state.ended, event, kMostEnded);
  note(event);
}

/// What is kept of an event beside the event.
function note(event) {
  if (event.kind === 'command') noteIncident(event.words);
  if (event.kind === 'boot') state.failures.set(event.node, event.words);
  if (event.kind === 'boot' || event.kind === 'advice') keep(state.notes, event, kMostNotes);
}

let adviceAt = 0;
/// The counts grow without events.
function askAdvice() {
  adviceAt = performance.now();
  askNetwork('api/advice').then(({advice}) => { state.advice = advice; tell('advice'); }, () => {});
}

function noteIncident(line) {
  const [verb, node, name, onOff] = line.split(/\s+/);
  if (verb !== 'incident') return;
  state.incidents[onOff === 'on' ? 'add' : 'delete'](`${placeOf(node)} ${name}`);
}

/// The place of a node by its name in commands: its ID or #place.
function placeOf(word) {
  const text = word.split('/').pop();
  if (text[0] === '#') return Number(text.slice(1));
  const id = /h$/i.test(text) ? parseInt(text, 16) : Number(text);
  return state.nodes.find(node => node.node === id)?.place;
}

/// Those of a transaction.
export async function eventsOf(transaction) {
  const begun = state.recent.findIndex(event => event.kind === 'begun' && event.transaction === transaction);
  if (begun > 0 && state.recent[begun - 1].number >= whole)  // the one before may be its Modbus request
    return state.recent.slice(begun - 1).filter(event => event.transaction === transaction);
  return (await ask(`api/journal?transaction=${transaction}`)).events;
}

function forget() {
  Object.assign(state, {nodes: [], registers: [], ended: [], recent: [], notes: [], advice: [], transaction: null, cursor: null});
  state.incidents.clear();
  state.failures.clear();
  tell('restart');
}

/// Processes the messages since the last call; called at most once per animation frame.
function flush() {
  scheduled = false;
  const events = pending;
  pending = [];
  const values = events.filter(event => event.kind === 'value');
  for (const event of events)
    if (event.number) take(event); else if (event.kind === 'missed') leaveOut(event.events);
  if (values.length) tell('values', values);
  if (events.length) tell('events', events);
  if (events.some(event => event.kind === 'advice') || (state.advice.length && performance.now() > adviceAt + 1000)) askAdvice();
  if (changed) tell('so');
  changed = false;
}

function leaveOut(count) {
  state.missed += count;
  gap = true;
}

function arrive(message) {
  const event = JSON.parse(message.data);
  if (event.kind === 'now') learn(event); else pending.push(event);
  if (pending.length > kMostPending) leaveOut(pending.splice(0, kMostPending / 2).length);
  if (!scheduled) requestAnimationFrame(flush);
  scheduled = true;
}

/// Nodes and registers that have changed.
function learn({network, nodes, registers, ...about}) {
  if (network !== state.network) return;
  const isRestarted = about.time < state.about?.time;
  state.about = about;
  changed = true;
  if (isRestarted) {
    last = 0;
    forget();
    return open();
  }
  state.nodes = [...state.nodes];
  for (const node of nodes) state.nodes[node.place - 1] = node;
  const all = new Map(state.registers.map(item => [item.register, item]));
  for (const item of registers) all.set(item.register, item);
  state.registers = [...all.values()];
}

function open() {
  source?.close();
  pending = [];  // the new stream repeats what comes after `last`
  const mine = source = server.follow(`api/events?state=${state.network}&since=${last}${watched && `&watch=${watched}`}`);
  source.onopen = () => tell('live', true);
  source.onmessage = arrive;
  source.onerror = () => {
    mine.close();
    if (mine !== source) return;
    tell('live', false);
    setTimeout(() => mine === source && open(), 300);
  };
}

/// Values of these objects arrive as topic 'values' from now on: "16:0x6064", 16 of them at most.
export function watch(objects) {
  watched = objects.map(object => prefix() + object).join(',');
  if (source) open();
}

export function chooseNetwork(number) {
  last = 0;
  state.network = number;
  forget();
  start();
}

export async function start() {
  const {network} = state, paths = ['api/nodes', 'api/transactions', 'api/journal?kinds=command,boot,advice', 'api/journal'];
  const found = await Promise.all(paths.map(askNetwork)).catch(() => null);
  if (network !== state.network) return;  // another one has been chosen
  if (found) {
    const [ended, noted, recent] = found.slice(1).map(answer => answer.events);
    state.nodes = found[0].nodes;
    // The answers are of different moments: from the first of `recent` on it alone counts, and after its last one the stream.
    const before = event => event.number < (recent[0]?.number ?? Infinity);
    for (const event of [...noted.filter(before), ...recent]) note(event);
    Object.assign(state, {ended: [...ended.filter(before), ...recent.filter(event => event.kind === 'ended')], recent});
    last = recent.at(-1)?.number ?? 0;
    tell('events', []);
    askAdvice();
  }
  open();
}

// ---- Commands

export const commands = {sent: 0, answered: 0};

/// Sends commands of docs/reference/commands.md, separated by semicolons; topics 'command' and 'response' show it and its response.
export async function send(line) {
  const mine = ++commands.sent;
  tell('command', line);
  let text;
  try {
    const response = await server.request('api/control', {method: 'POST', body: line.replaceAll(';', '\n')});
    text = (await response.text()).trim();
    if (text[0] === '{') text = `error: ${JSON.parse(text).error}`;
  } catch { text = 'error: the simulator cannot be reached'; }
  ++commands.answered;
  if (mine === commands.sent) tell('response', text);
  return text;
}
