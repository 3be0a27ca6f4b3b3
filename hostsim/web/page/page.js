// SPDX-License-Identifier: MIT
// The page: header, commands, cards.

import {state, on, element, make, send, start, prefix, chooseNetwork} from './state.js';
import {clock, number} from './words.js';
import {startLadder} from './ladder.js';
import {startHappened} from './happened.js';
import {startRegisters} from './registers.js';
import {startPlant} from './plant.js';
import {startPlots} from './plots.js';
import {saveScenario} from './scenario.js';

const history = [];
let place = 0, base = null;

function rates() {
  const now = state.about;
  if (!base || now.time < base.about.time) base = {about: now, load: '0', frames: 0, requests: 0};
  const passed = now.time - base.about.time;
  if (passed < 0.9) return base;
  const at = about => about.networks[state.network - 1];
  const bits = at(now).bits - at(base.about).bits;
  const rate = at(now).bit_rate;
  base = {about: now, frames: (at(now).frames - at(base.about).frames) / passed, requests: (now.requests - base.about.requests) / passed,
    load: rate ? `${(bits / passed / rate * 100).toFixed(1)} % of ${rate / 1000} kbit/s` : `${number(Math.round(bits / passed / 1000))} kbit/s`};
  return base;
}

function facts() {
  const {frames, requests, load} = rates(), about = state.about;
  const parts = {time: clock(about.time),
    ...about.modbus && {Modbus: about.modbus, clients: about.clients, 'requests/s': number(Math.round(requests))},
    'frames/s': number(Math.round(frames)), 'bus load': load};
  if (state.missed) parts['left out'] = number(state.missed);
  const host = element('facts');
  if (host.children.length !== Object.keys(parts).length)
    host.replaceChildren(...Object.keys(parts).map(name => make('div', {}, make('dt', {className: 'quiet', textContent: name}), make('dd', {className: 'number'}))));
  Object.values(parts).forEach((text, at) => { host.children[at].lastChild.textContent = text; });
  element('manual').hidden = about.clock !== 'manual';
  const select = element('network');
  select.hidden = about.networks.length < 2;
  if (select.options.length !== about.networks.length)
    select.replaceChildren(...about.networks.map(({network}) => new Option(`network ${network}`, network)));
}

function live(yes) {
  document.body.classList.toggle('gone', !yes);
  Object.assign(element('live'), {textContent: yes ? 'live' : 'no simulator', className: `pill ${yes ? 'good' : 'bad'}`});
}

function remember(line) {
  if (history.at(-1) !== line) history.push(line);
  if (history.length > 100) history.shift();
  place = history.length;
  element('command').value = line;
  Object.assign(element('answer'), {textContent: '…', className: 'quiet'});
}

function answered(text) {
  const last = text.split('\n').at(-1);
  Object.assign(element('answer'), {textContent: last, title: text, className: last.startsWith('error') ? 'bad' : 'good'});
}

async function copy() {
  const field = element('command');
  field.select();
  try { await navigator.clipboard.writeText(field.value); } catch { document.execCommand('copy'); }
  element('copy').textContent = 'Copied';
  setTimeout(() => { element('copy').textContent = 'Copy'; }, 1000);
}

function browse(event) {
  const by = {ArrowUp: -1, ArrowDown: 1}[event.key];
  if (event.key === 'Escape') event.target.value = '';
  if (!by || !history.length) return;
  place = Math.min(history.length - 1, Math.max(0, place + by));
  event.target.value = history[place];
  event.preventDefault();
}

on('so', facts);
on('live', live);
on('command', remember);
on('response', answered);
element('command-form').onsubmit = event => {
  event.preventDefault();
  if (element('command').value.trim()) send(element('command').value.trim());
};
element('command').onkeydown = browse;
element('copy').onclick = copy;
element('network').onchange = event => chooseNetwork(Number(event.target.value));
element('save').onclick = () => saveScenario().then(
  text => answered(`ok, ${text.split('\n').length} lines`), error => answered(`error: ${error.message}`));
for (const button of document.querySelectorAll('[data-line]')) button.onclick = () => send(button.dataset.line.replace('all', `${prefix()}all`));
startLadder();
startHappened();
startRegisters();
startPlots();
startPlant();
start();
