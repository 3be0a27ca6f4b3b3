// SPDX-License-Identifier: MIT
// The ladder diagram of one transaction: messages between PLC, coprocessor and node, and waiting times.

import {state, on, tell, element, make, svg, nearest, eventsOf, send, prefix} from './state.js';
import {hex, nodeHex, objectText, duration, valueText, inHex, driveState, registersOf, kServices} from './words.js';

const kRow = 34, kTop = 44, kTimes = 66, kRegisters = 88, kLine = 13, kPause = 0.002, kMostRows = 400, kMostRegisters = 12;
let shown = null, asked = 0, busy = false;

const milliseconds = new Intl.NumberFormat('en-US', {minimumFractionDigits: 3, maximumFractionDigits: 3}).format;
const nodeName = id => state.nodes.find(node => node.node === id)?.name ?? '';
/// "5C2 · 4B 11 64" of "5C2#4B1164".
const framed = text => text.replace(/#(.*)/, (_, data) => ` · ${data.replace(/(..)(?=.)/g, '$1 ')}`);
/// The height of a pause is logarithmic.
const heightOf = row => row.pause ? kRow * (0.9 + 0.25 * Math.log10(Math.max(1, row.pause))) : kRow;

// ---- Rows: {from, to, what, more, kind, time, registers}; 0 the PLC, 1 the coprocessor, 2 the node

/// Words of the window in the bases in which people know them, others in decimal.
const wordText = (register, word) =>
  (register === 3700 && word > 15) || register === 3703 || (register > 3705 && register < 3770) ? hex(word) : String(word);
const listed = (first, words) => words.slice(0, kMostRegisters).map((word, at) => `R${first + at} ${wordText(first + at, word)}`);
/// The registers from R3706 on of a value that a transaction has, up to 4 bytes.
const dataOf = ({bytes}) => (bytes.length > 8 ? [] : bytes.match(/..(..)?/g) ?? []).map(text => parseInt(text.slice(2) + text.slice(0, 2), 16));

function modbusRow(event) {
  const {first, words, writes} = registersOf(event);
  const at = register => words[register - first];
  const executes = at(3700) === 0xCA0E, polled = executes ? 'busy' : 'reads';
  if (!writes) return {from: 1, to: 0, kind: 'poll', what: polled, fold: polled, more: event.words};
  const object = at(3703) === undefined ? '' : objectText(at(3703), at(3704) ?? 0);
  return {from: 0, to: 1, kind: 'modbus', what: [executes ? 'execute:' : '', kServices[at(3701)] ?? 'write', object].filter(Boolean).join(' '),
    registers: listed(first, words)};
}

/// The first row of a transaction without a PLC's request: a command.
function begunRow(event) {
  const service = Number(Object.keys(kServices).find(code => kServices[code] === event.service)), size = event.bytes.length / 2;
  const words = [0xCA0E, service, event.node, event.index, event.sub, ...size ? [size, ...dataOf(event)] : []];
  return {from: 0, to: 1, kind: 'modbus', what: inHex(event.words), more: 'by a command', registers: service ? listed(3700, words) : []};
}

function frameRow(event) {
  const [id, data] = event.frame.split('#');
  const number = parseInt(id, 16);
  const fromNode = (number >= 0x580 && number < 0x600) || (number >= 0x700 && !data.startsWith('R')) ||
    (number >= 0x80 && number < 0x580);
  const aborts = /^(SDO node \d+: )abort/.test(event.words);
  return {from: fromNode ? 2 : 1, to: fromNode ? 1 : 2, kind: aborts ? 'bad' : 'frame',
    what: inHex(event.words.replace(/^SDO node \d+: /, '')), more: framed(event.frame)};
}

function faultRow(event) {
  const [, fault, kind, frame = ''] = /(fault \d+): ([^:]*)(?:: (.*))?$/.exec(event.words) ?? [, event.words, ''];
  const swallowed = /never|silent|loss|stops|bus-off/.test(kind);
  return {from: 2, to: 1, kind: 'bad fault', swallowed, what: `${fault}: ${kind}${swallowed ? ' swallowed this' : ''}`,
    more: frame && framed(frame)};
}

const resultWords = event => event.code && !event.ok ? [event.code & 0xFFFF, event.code >>> 16] : event.service === 'read' ? dataOf(event) : [];

function resultRow(event) {
  return {from: 1, to: 0, kind: event.ok ? 'good' : 'bad',
    what: event.result < 0 ? 'taken back by the PLC' : `R3700 = ${event.result} · ${event.outcome}`,
    more: event.service === 'read' && event.ok ? `value ${valueText(event.index, event.sub, event.value)}` : '',
    registers: event.result < 0 ? [] : [...listed(3700, [event.result]), ...listed(3706, resultWords(event))]};
}

/// The reason of a pause.
function pauseText(before, after) {
  if (after.kind === 'bad' && after.from === 1) return 'SDO time-out';
  if (before?.from === 0) return 'held back: quarantine';
  return before?.to === 2 || before?.swallowed ? 'waits for the node' : 'waits';
}

function rowsOf(events) {
  const rows = [], make = {modbus: modbusRow, begun: begunRow, frame: frameRow, fault: faultRow, ended: resultRow};
  for (const event of events) {
    const row = make[event.kind]?.(event);
    if (!row || (event.kind === 'begun' && rows.length)) continue;
    row.time = event.time;
    const polls = row.fold && rows.at(-1);
    if (polls && polls.fold === row.fold && (row.fold === 'busy' || polls.more === row.more)) {
      polls.count = (polls.count ?? 1) + 1;
      polls.what = `${row.fold} × ${polls.count}`;
      continue;
    }
    rows.push(row);
  }
  const all = [];
  let quiet = rows[0]?.time;
  for (const row of rows) {
    const before = all.findLast(other => other.fold !== 'busy');
    if (row.fold !== 'busy') {
      if (row.time - quiet >= kPause && row.kind !== 'poll')
        all.push({pause: (row.time - quiet) * 1000, kind: 'pause', what: pauseText(before, row), time: quiet});
      quiet = row.time;
    }
    all.push(row);
  }
  return all.slice(0, kMostRows);
}

// ---- Drawing

/// Shortens a text until it fits, by its measured length.
function fit(text, room) {
  const whole = text.textContent;
  if (text.getComputedTextLength() <= room) return;
  let keep = Math.floor(whole.length * room / text.getComputedTextLength()) - 1;
  do text.textContent = whole.slice(0, keep--) + '…'; while (keep > 3 && text.getComputedTextLength() > room);
}

function arrow(x1, x2, y, row) {
  const way = Math.sign(x2 - x1), end = row.swallowed ? x1 + (x2 - x1) * 0.45 : x2 - way * 3;
  const head = row.swallowed ? `M${end - 5} ${y - 5}l10 10m0-10l-10 10` : `M${end} ${y}l${-8 * way} -4m${8 * way} 4l${-8 * way} 4`;
  return [svg('path', {d: `M${x1 + way * 3} ${y}H${end}`}), svg('path', {d: head})];
}

function drawRow(row, y, lives, width, start) {
  const group = svg('g', {class: row.kind, 'data-time': row.time}), left = lives[0] - 8, after = milliseconds((row.time - start) * 1000);
  group.append(svg('title', {}, `${after} ms\n${row.what}\n${row.more ?? ''}`));
  if (left > kTimes + kRegisters) group.append(svg('text', {class: 'small time', x: kTimes - 8, y: y + 4, 'text-anchor': 'end'}, after));
  for (const [at, text] of (row.registers ?? []).entries())
    group.append(svg('text', {class: 'small register', x: left - kRegisters + 8, y: y + 4 + at * kLine}, text));
  if (row.pause) {
    group.append(svg('rect', {x: lives[1] - 5, y: y - 12, width: 10, height: heightOf(row) - 8, rx: 3}),
      svg('text', {class: 'what', x: lives[1] + 12, y: y + heightOf(row) / 2 - 17}, duration(row.pause)),
      svg('text', {class: 'what', x: lives[1] + 12, y: y + heightOf(row) / 2 - 3}, row.what));
    return group;
  }
  const right = row.from === 2 || row.to === 2;
  const place = right ? {x: width - 4, 'text-anchor': 'end'} : {x: lives[0] + 6};
  group.append(...arrow(lives[row.from], lives[row.to], y, row),
    svg('text', {class: 'what', y: y - 6, ...place}, row.what), svg('text', {class: 'small', y: y + 14, ...place}, row.more ?? ''));
  return group;
}

function draw() {
  const host = element('diagram'), width = host.clientWidth;
  if (!shown || width === 0) return;
  const {ended, rows} = shown;
  const gutter = kRegisters + (width < 480 ? 4 : kTimes + 4), lives = [gutter + 8, gutter + (width - gutter) * 0.5, width - 30];
  const picture = svg('svg', {});
  const node = ended.node ? `node ${ended.node} ${width < 480 ? '' : `(${nodeHex(ended.node)})`}` : ended.service === 'nmt' ? 'all nodes' : 'own node';
  ['PLC', 'coprocessor', node].forEach((name, at) => {
    const anchor = ['start', 'middle', 'end'][at], x = at === 1 ? lives[1] : at ? width - 4 : gutter;
    picture.append(svg('path', {class: 'life'}),
      svg('text', {class: 'name', x, y: 12, 'text-anchor': anchor}, name),
      svg('text', {class: 'small', x, y: 26, 'text-anchor': anchor}, at === 2 ? nodeName(ended.node) : ''));
  });
  if (width >= 480) picture.append(svg('text', {class: 'small', x: kTimes - 8, y: 12, 'text-anchor': 'end'}, 'ms'));
  let y = kTop + 16, free = 0;  // where the registers of the row before end
  for (const row of rows) {
    if (row.registers?.length) y = Math.max(y, free);
    picture.append(drawRow(row, y, lives, width, rows[0].time));
    if (row.registers) free = y + row.registers.length * kLine + 8;
    y += heightOf(row);
  }
  const height = Math.max(y, free) - 10;
  for (const [at, path] of picture.querySelectorAll('.life').entries()) path.setAttribute('d', `M${lives[at]} ${kTop - 12}V${height - 4}`);
  picture.setAttribute('viewBox', `0 0 ${width} ${height}`);
  picture.setAttribute('height', height);
  const top = host.scrollTop;
  host.replaceChildren(picture);
  host.scrollTop = top;
  for (const text of picture.querySelectorAll('g text:not(.time, .register)'))
    fit(text, text.parentNode.classList.contains('pause') ? width - lives[1] - 16 : width - gutter - 18);
  for (const text of picture.querySelectorAll('g text.what')) interrupt(text);
  mark();
}

/// No life line goes through a label.
function interrupt(text) {
  const {x, y, width, height} = text.getBBox();
  text.before(svg('rect', {class: 'label', x: x - 3, y, width: width + 6, height}));
}

function verdict(ended) {
  const lines = [[`#${ended.transaction}  ${inHex(ended.words)}`, 'strong'],
    [`${ended.result < 0 ? 'taken back' : ended.outcome} · ${duration(ended.took_ms)}`, ended.ok ? 'good' : 'bad']];
  lines.forEach(([text, name], at) =>
    Object.assign(element('verdict').children[at], {textContent: text, className: name, title: text}));
}

/// What the PLC programmer can do better, with how often it has been seen.
function advise() {
  element('advice').replaceChildren(...(shown?.advice ?? []).map(event => {
    const count = state.advice.find(({number}) => number === event.number)?.count ?? 1;
    const times = make('span', {className: 'quiet', textContent: count > 1 ? `; ${count} times` : ''});
    return make('p', {}, make('b', {textContent: 'Advice'}), ` ${event.words}`, times);
  }));
}

async function show(number) {
  asked = number;
  if (busy) return;
  busy = true;
  while (asked) {
    const wanted = asked;
    asked = 0;
    const events = await eventsOf(wanted).catch(() => []);
    const ended = events.find(event => event.kind === 'ended');
    if (!ended) continue;
    shown = {ended, rows: rowsOf(events), advice: events.filter(({kind}) => kind === 'advice')};
    verdict(ended);
    advise();
    draw();
  }
  busy = false;
}

export function chooseTransaction(number, follow = false) {
  element('follow').checked = follow;
  if (state.transaction === number) return;
  state.transaction = number;
  const event = state.ended.find(ended => ended.transaction === number);
  if (event && !follow) tell('cursor', state.cursor = event.time);
  tell('transaction', number);
  show(number);
}

function step(by) {
  const at = state.ended.findIndex(event => event.transaction === state.transaction);
  const next = state.ended[at + by];
  if (next) chooseTransaction(next.transaction);
}

/// What to try before there is a transaction: title, what happens and where to look, the commands.
function trials() {
  const node = state.nodes.find(each => each.node && each.state !== 'off')?.node;
  const drive = state.nodes.find(each => each.node && each.statusword !== undefined)?.node;
  const read = `trigger ${prefix()}read ${node} 0x1000 0 4`;
  return [
    node && ['Read', `A PLC reads the device type of node ${node}: each message of it appears here.`, () => send(read)],
    drive && ['Move the drive', `Node ${drive} is enabled and moves: look at the plot.`, () => move(drive)],
    node && ['Break something', `Node ${node} does not respond: see what the PLC gets, and when.`,
      () => send(`fault ${prefix()}${node} response-never count=1; ${read}`)],
  ].filter(Boolean);
}

/// As a PLC has to: after each control word it reads 6041h until the drive is in the state.
async function move(drive) {
  const done = `wait register ${prefix()}3700 != 51726`, status = `trigger ${prefix()}read ${drive} 0x6041 0 2; ${done}; read ${prefix()}3706`;
  const write = (object, size, ...words) => send(`trigger ${prefix()}write ${drive} ${object} 0 ${size} ${words.join(' ')}; ${done}`);
  await send(`nmt start ${prefix()}${drive}`);
  for (const [word, wanted] of [[6, 'ready to switch on'], [7, 'switched on'], [15, 'operation enabled']]) {
    await write('0x6040', 2, word);
    for (let tries = 0; driveState(Number((await send(status)).split(' ').at(-1))) !== wanted; ++tries) {
      if (tries === 20) return;
      await send('pass 10ms');
    }
  }
  for (const words of [['0x6060', 1, 1], ['0x6081', 4, 20000, 0], ['0x607A', 4, 60000, 0], ['0x6040', 2, 31]]) await write(...words);
}

function empty() {
  element('diagram').replaceChildren(
    make('p', {className: 'quiet', textContent: 'No transaction yet: a PLC writes CA0Eh to R3700. Or try:'}),
    ...trials().map(([title, what, act]) => make('button', {className: 'trial', onclick: act},
      make('b', {textContent: title}), make('span', {className: 'quiet', textContent: what}))));
}

function mark() {
  const groups = [...element('diagram').querySelectorAll('g')], near = nearest(groups, group => group.dataset.time);
  for (const group of groups) group.classList.toggle('near', group === near);
}

export function startLadder() {
  empty();
  new ResizeObserver(draw).observe(element('diagram'));
  element('older').onclick = () => step(-1);
  element('newer').onclick = () => step(1);
  element('follow').onchange = latest;
  element('diagram').addEventListener('click', event => {
    const group = event.target.closest('g');
    if (group) tell('cursor', state.cursor = Number(group.dataset.time));
  });
  function latest() {
    const last = state.ended.at(-1);
    if (last && element('follow').checked) chooseTransaction(last.transaction, true);
  }
  on('events', events => {
    latest();
    // The PLC reads the result after the end; further reads of a followed transaction change only a number.
    const complete = element('follow').checked && shown?.ended.transaction === state.transaction && shown.rows.some(row => row.fold === 'reads');
    const more = event => event.transaction === state.transaction && (complete ? event.kind === 'advice' : event.kind !== 'ended');
    if (events.some(more)) show(state.transaction);
  });
  on('so', () => { if (!shown && !state.ended.length && !element('diagram').matches(':focus-within')) empty(); });
  on('advice', advise);
  on('cursor', mark);
  on('restart', () => {
    shown = null;
    element('follow').checked = true;
    for (const line of element('verdict').children) line.textContent = '';
    advise();
    empty();
  });
}
