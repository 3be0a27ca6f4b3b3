// SPDX-License-Identifier: MIT
// The list of the last transactions, or of all events, with filters.

import {state, on, tell, element, nearest, askWords} from './state.js';
import {duration, nodeText} from './words.js';
import {List, choice} from './list.js';
import {chooseTransaction} from './ladder.js';

const kMostListed = 1000;
let view = 'transactions', list;

const kinds = {
  transactions: {
    kind: 'transaction', key: event => event.number,
    cells: event => [[`#${event.transaction}`, 'quiet'], [event.words, 'words'],
      [event.outcome, event.ok ? 'good words' : 'bad words'], [duration(event.took_ms), 'right quiet']],
  },
  everything: {
    kind: 'event', key: event => event.number,
    cells: event => [[event.time.toFixed(3), 'quiet right'], [event.transaction ? `#${event.transaction}` : '', 'quiet'],
      [`${event.kind === 'command' && !event.refused ? event.words : event.text.replace(/^#\d+ /, '')}${event.times ? ` × ${event.times}` : ''}`, wordsClass(event)],
      [event.kind, 'quiet']],
  },
};

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
    (!failed || event.ok === false || event.kind === 'fault') && (!slow || event.took_ms > 10) &&
    (!text || event.text.toLowerCase().includes(text));
}

function update() {
  const found = [], all = view === 'transactions' ? state.ended : state.recent, pass = passes();
  for (let at = all.length; at-- > 0 && found.length < kMostListed;) if (pass(all[at])) found.push(all[at]);
  list.items = view === 'everything' ? folded(found) : found;
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
