// SPDX-License-Identifier: MIT
// The last minute as a scenario: what had been changed before comes at its start.

import {ask} from './state.js';
import {registersOf} from './words.js';

const kMinute = 60;
const quoted = text => `"${text.replace(/[\\"]/g, '\\$&')}"`;
const step = (at, keys) => `\n[[step]]\nat = "${Math.max(0, Math.round(at * 1e6))}us"\n${keys}\n`;

function lineOf(event) {
  if (event.kind === 'command') return event.words;
  const {first, words, writes} = registersOf(event);
  const network = event.network > 1 ? `${event.network}/` : '';
  return writes && !event.exception ? `write ${network}${first} ${words.join(' ')}` : null;
}

export function scenarioOf(events, about) {
  const begin = Math.max(0, about.time - kMinute);
  let text = `# Saved from the page: ${(about.time - begin).toFixed(1)} s up to ${about.time.toFixed(6)}.\n`;
  if (about.plant) text += `plant = ${quoted(about.plant)}\n`;
  const before = [], steps = [];
  for (const event of events) {
    const line = ['command', 'modbus'].includes(event.kind) ? lineOf(event) : null;
    if (line && event.time < begin) { if (event.kind === 'command' && !/^(trigger|write|send)/.test(line)) before.push(line); }
    else if (line) steps.push(step(event.time - begin, `do = ${quoted(line)}`));
    if (event.kind === 'ended' && event.time >= begin) steps.push(`# #${event.transaction} ${event.words}: ${event.outcome}\n`);
  }
  if (before.length) text += step(0, `do = [\n${before.map(line => `  ${quoted(line)},\n`).join('')}]`);
  return text + steps.join('') + step(about.time - begin, `expect = "time ${Math.round((about.time - begin) * 1e6)}us"`);
}

export async function saveScenario() {
  const about = await ask('api/time'), events = [];
  let before = about.next_event, page;
  do {
    page = (await ask(`api/journal?kinds=command,modbus,ended&before=${before}`)).events;
    events.unshift(...page);
    before = page[0]?.number;
  } while (page.length === 1000 && events.length < 20000);
  const text = scenarioOf(events, about);
  const link = Object.assign(document.createElement('a'), {download: 'last-minute.toml',
    href: URL.createObjectURL(new Blob([text], {type: 'application/toml'}))});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  return text;
}
