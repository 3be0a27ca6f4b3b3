// SPDX-License-Identifier: MIT
// The plant of a tab: answers the page's requests as an HTTP server does, in real time.

import {Clock, Instance} from './instance.js';

const kHere = '127.0.0.1:80', kWrong = 2;
const kTurn = 20;  // milliseconds
const module = load();
const streams = new Map();  // of the page's requests
const channel = new MessageChannel();
let instance, begin, timer, clock, turning = false, ended = '';
const begun = new Promise(resolve => { begin = resolve; });

async function load() {
  const response = await fetch('cbcan.wasm');
  if (!response.ok) throw new Error(`cbcan.wasm: ${response.status} ${response.statusText}`);
  const streamed = response.headers.get('Content-Type') === 'application/wasm';
  return streamed ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

/// A file of plants/ or scenarios/ next to the page, also for a dropped file that is in neither.
async function shipped(name) {
  const {href} = new URL(name.replace(/^(\.\.\/)+/, ''), location);
  if (!['plants/', 'scenarios/'].some(folder => href.startsWith(new URL(folder, location)))) return null;
  const response = await fetch(href);
  return response.ok ? response.text() : null;
}

// ---- Plants

/// The instance, and the outcome for the page.
async function make({main, files}) {
  const made = new Instance(await module);
  const read = async name => {
    const key = [name, name.replace(/.*\//, '')].find(key => Object.hasOwn(files, key));
    return key === undefined ? shipped(name) : files[key];
  };
  const said = () => made.call('told').map(([, text]) => text).join('').trimEnd();
  const isScenario = /^\[\[step\]\]/m.test(await read(main));
  const options = main === 'demo' ? ['--demo', '--network-file', 'demo:/network.toml'] : ['--config', main];
  const started = await made.start(isScenario ? ['run', main] : [...options, '--http', kHere], {read, folder: '.'});
  if (isScenario) {
    await made.play(0, {read});
    const report = said(), {exit} = made.call('played');
    if (exit === kWrong) throw new Error(report);
    made.call('show', {place: 0});
    return [made, {report, kind: exit === 0 ? 'good' : 'bad'}];
  }
  if (!started.services) throw new Error(said());
  made.call('serve', {places: [`http ${kHere}`], since_1970: Date.now() * 1000, alone: false});
  return [made, {report: said(), kind: ''}];
}

async function open(plant) {
  const [made, outcome] = await make(plant);
  instance = made;
  clock = new Clock();
  begin();
  soon();
  return outcome;
}

const check = async plant => (await make(plant))[1];

/// For whatever reason the plant has ended, it is not used any more.
function stop(text) {
  ended = text;
  for (const [id, {status}] of streams) postMessage({id, status, text: '', more: false});
  streams.clear();
  postMessage({text});
}

// ---- Time

function turn() {
  turning = false;
  clearTimeout(timer);
  if (ended) return;
  try {
    const time = clock.now(), next = instance.pass(time);
    for (const [id, stream] of streams) fill(id, stream);
    for (const [to, text] of instance.call('told'))
      if (to === 'end') return stop('The plant has been shut down.');
      else if (text) console.info(text.trimEnd());
    if (next <= time) soon();
    else timer = setTimeout(turn, Math.min(kTurn, (next - time) / 1000));
  } catch (error) { stop(error.message); }
}

function soon() {
  if (!turning) channel.port2.postMessage(0);
  turning = true;
}

// ---- Requests

async function request({path, method = 'GET', body = ''}, id) {
  await begun;
  const url = new URL(path, 'http://localhost');
  const query = Object.fromEntries(url.searchParams);
  try {
    if (ended) throw new Error(ended);
    instance.pass(clock.now());
    const {status, stream, body: text = ''} =
      instance.call('respond', {method, path: decodeURIComponent(url.pathname), query, body, host: url.host});
    if (stream) streams.set(id, {stream, status});
    soon();
    return {status, text, more: Boolean(stream)};
  } catch (error) {
    if (!ended) stop(error.message);
    return {status: 503, text: JSON.stringify({error: ended}), more: false};
  }
}

function fill(id, {stream, status}) {
  const {text, more} = instance.call('fill', {stream});
  if (text || !more) postMessage({id, status, text, more});
  if (!more) streams.delete(id);
}

function drop(id) {
  const found = streams.get(id);
  if (found) instance.call('drop', {stream: found.stream});
  streams.delete(id);
}

channel.port1.onmessage = turn;
const calls = {open, check, request, drop};
onmessage = async ({data: {id, call, given}}) => {
  try { postMessage({id, ...await calls[call](given, id)}); } catch (error) { postMessage({id, error: error.message}); }
};
