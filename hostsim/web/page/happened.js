// SPDX-License-Identifier: MIT
// The list of the last transactions, or of all events, with filters.

import {state, on, tell, element, nearest, askWords} from './state.js';
import {duration, nodeText, inHex} from './words.js';
import {List, choice} from './list.js';
import {chooseTransaction} from './ladder.js';

const kMostListed = 1000;
let view = 'transactions', list;

const kinds = {
  transactions: {
    kind: 'transaction', key: event => event.key ?? event.number,
    cells: event => event.part ? noteCells(event) : [[event.time.toFixed(3), 'quiet right'], [`#${event.transaction}`, 'quiet'],
      [inHex(event.words), 'words'], [outcomeOf(event), `right words ${event.ok ? 'good' : 'bad'}`, `${event.outcome}, ${duration(event.took_ms)}`]],
  },
  everything: {
    kind: 'event', key: event => event.key ?? event.number,
    cells: event => event.part ? noteCells(event) : [[event.time.toFixed(6), 'quiet right'],
      [event.transaction ? `#${event.transaction}` : event.kind, 'quiet', event.kind],
      [`${wordsOf(event)}${event.times ? ` × ${event.times}` : ''}`, wordsClass(event)]],
  },
};

const wordsOf = event => event.kind === 'command' && !event.refused ? event.words : inHex(event.text.replace(/^#\d+ /, ''));
/// Of a failure the abort code, and the time.
const outcomeOf = ({ok, code, outcome, took_ms: took}) => `${ok ? '' : `${code ? outcome.slice(0, 10) : outcome} · `}${duration(took)}`;
const noteCells = ({time, kind, first, part, tint}) =>
  [[first ? time.toFixed(3) : '', 'quiet right'], [first ? kind : '', tint], [part, `whole words ${tint}`]];

/// Advice and failed boots are whole: each has as many rows as its words need.
function rowsOf(event) {
  const tint = {boot: 'bad', advice: 'wait'}[event.kind], room = Math.max(30, Math.floor((list.host.clientWidth - 130) / 6.5));
  const parts = tint ? event.words.match(new RegExp(`.{1,${room}}(?:\\s|$)|\\S+`, 'g')) ?? [''] : [];
  return tint ? parts.map((part, at) => ({...event, key: `${event.number}.${at}`, first: at === 0, part, tint})) : [event];
}

function wordsClass(event) {
  const bad = event.kind === 'fault' || event.ok === false || event.refused || (event.kind === 'emcy' && event.code !== 0);
  return bad ? 'bad words' : 'words';
}

/// The newest first: requests that repeat the one before are one line with their number.
function folded(events) {
  const found = [];
  for (const event of events) {
    const last = found.at(-1);
    if (last && event.kind === 'modbus' && last.kind === 'modbus' && last.text === event.text) last.times = (last.times ?? 1) + 1;
    else found.push({...event});
  }
  return found;
}

function passes() {
  const kind = view === 'everything' ? element('filter-kind').value : '';
  const node = Number(element('filter-node').value), service = element('filter-service').value;
  const failed = element('filter-failed').checked, slow = element('filter-slow').checked;
  const text = element('filter-text').value.toLowerCase();
  return event => (!kind || event.kind === kind) && (!node || event.node === node) && (!service || event.service === service) &&
    (!failed || event.ok === false || ['fault', 'boot'].includes(event.kind)) && (!slow || event.took_ms > 10) &&
    (!text || event.text.toLowerCase().includes(text));
}

function update() {
  const found = [], pass = passes();
  const all = view === 'everything' ? state.recent : [...state.ended, ...state.notes].sort((a, b) => a.number - b.number);
  for (let at = all.length; at-- > 0 && found.length < kMostListed;) if (pass(all[at])) found.push(all[at]);
  list.items = (view === 'everything' ? folded(found) : found).flatMap(rowsOf);
}

function mark() {
  const near = nearest(list.items, event => event.time);
  list.mark = event => event === near ? 'near' : '';
  list.draw();
}

function fillNodes() {
  const select = element('filter-node');
  if (select.options.length === state.nodes.length + 1) return;
  select.replaceChildren(new Option('all nodes', ''),
    ...state.nodes.map(node => new Option(`${nodeText(node.node)} ${node.name}`, node.node)));
}

export function startHappened() {
  list = new List(element('event-list'), {...kinds.transactions,
    choose: event => {
      if (event.transaction) chooseTransaction(event.transaction);
      tell('cursor', state.cursor = event.time);
    }});
  choice(element('event-view'), {transactions: 'Transactions', everything: 'Everything'}, view, key => {
    view = key;
    Object.assign(list, kinds[key]);
    element('filter-kind').hidden = key !== 'everything';
    element('filter-service').hidden = key === 'everything';
    update();
  });
  element('filters').oninput = update;
  element('filters').onsubmit = event => event.preventDefault();
  askWords().then(({kinds: names}) => element('filter-kind').append(...names.map(name => new Option(name))));
  on('events', update);
  on('restart', update);
  on('so', fillNodes);
  on('cursor', mark);
  on('transaction', number => {
    const event = state.ended.find(ended => ended.transaction === number);
    if (event && view === 'transactions') list.pick(event.number, true);
  });
}
