// SPDX-License-Identifier: MIT
// What the page has in a tab alone: the choice of a plant, which the address names, and files that become a plant.

import {open, check, ended} from './server.js';
import {ask, element, make} from './state.js';
import {kScenarios} from './shipped.js';

const kPlants = {demo: 'Demo plant', 'plants/tank.toml': 'Tank'};
const kDemo = {main: 'demo', files: {}};
let present = kDemo;

// ---- The address

const through = async (stream, content) => new Response(new Blob([content]).stream().pipeThrough(stream)).arrayBuffer();

async function addressOf(plant) {
  const bytes = new Uint8Array(await through(new CompressionStream('deflate-raw'), JSON.stringify(plant)));
  const text = btoa(Array.from(bytes, byte => String.fromCharCode(byte)).join(''));
  return `#plant=${text.replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '')}`;
}

async function plantOf(address) {
  if (address === '') return kDemo;
  if (Object.hasOwn(kPlants, address) || kScenarios.includes(address)) return {main: address, files: {}};
  try {
    const text = atob(address.replace(/^plant=/, '').replaceAll('-', '+').replaceAll('_', '/'));
    const bytes = Uint8Array.from(text, letter => letter.charCodeAt(0));
    const {main, files} = JSON.parse(new TextDecoder().decode(await through(new DecompressionStream('deflate-raw'), bytes)));
    if ([main, ...Object.values(files)].every(part => typeof part === 'string')) return {main, files};
  } catch { /* the same message */ }
  throw new Error('The address names no plant, or is incomplete.');
}

// ---- Files

/// Many tools write EDS files in the code page of Windows.
function textOf(bytes) {
  try { return new TextDecoder('utf-8', {fatal: true}).decode(bytes); } catch { return new TextDecoder('windows-1252').decode(bytes); }
}

/// The present plant with a node for each of these EDS files.
async function withNodes(found) {
  const main = present.main === 'demo' ? 'plants/demo/plant.toml' : present.main;
  const files = {...present.files, [main]: present.files[main] ?? await (await fetch(main)).text()};
  const own = /^\s*node_id\s*=\s*(\w+)/m.exec(files[main])?.[1] ?? 127;
  const used = [Number(own), ...(await ask('api/nodes')).nodes.map(({node}) => node)];
  for (const [name, text] of Object.entries(found)) {
    if (!/\.(eds|dcf)$/i.test(name)) throw new Error(`${name}: choose EDS or DCF files, or a plant file (TOML) and all files that it names`);
    let id = 1;
    while (used.includes(id)) ++id;
    used.push(id);
    const eds = `${id}/${name}`;  // no other file has this name
    files[main] += `\n[[node]]\nid = ${id}\neds = ${JSON.stringify(eds)}\n`;
    files[main.replace(/[^/]*$/, eds)] = text;
  }
  return {main, files};
}

async function take(list) {
  try {
    const found = Object.fromEntries(await Promise.all(Array.from(list, async file => [file.name, textOf(await file.arrayBuffer())])));
    const main = Object.keys(found).find(name => /\.toml$/i.test(name));
    const plant = main ? {main, files: found} : await withNodes(found);
    await check(plant);
    location.hash = await addressOf(plant);
  } catch (error) { say(`${error.message}\nThe plant stays as it is.`, 'bad'); }
}

// ---- The page

function say(text, className, button = 'Close', act = () => { element('message').hidden = true; }) {
  element('message').replaceChildren(make('pre', {textContent: text}), make('button', {textContent: button, onclick: act}));
  Object.assign(element('message'), {className, hidden: false});
}

const group = (label, ...options) => make('optgroup', {label}, ...options);
const words = path => path.replace(/.*\/|\.toml$/g, '').replaceAll('_', ' ');

function build() {
  const choose = make('select', {id: 'chooser', ariaLabel: 'Plant or scenario', onchange: () => { location.hash = choose.value; }},
    group('Plants', ...Object.entries(kPlants).map(([path, name]) => new Option(name, path))),
    group('Scenarios', ...kScenarios.map(path => new Option(words(path), path))));
  const field = make('input', {type: 'file', id: 'files', multiple: true, hidden: true, onchange: () => { take(field.files); field.value = ''; }});
  const button = make('button', {textContent: 'Add files', onclick: () => field.click(),
    title: 'An EDS file becomes a node, also if you drop it on the page. A plant file and its EDS files become the plant.'});
  document.querySelector('.tools').prepend(choose, button, field);
  document.querySelector('header').after(make('div', {id: 'message', role: 'status', hidden: true}));
}

async function begin() {
  try {
    const plant = await plantOf(location.hash.slice(1));
    const {report, kind} = await open(plant);
    present = plant;
    const added = Object.keys(plant.files).map(path => /(\d+)\/([^/]+)$/.exec(path)).filter(Boolean);
    const said = [report, ...added.map(([, id, name]) => `${name} is node ${id}.`)].filter(Boolean).join('\n');
    if (said) say(said, kind);
  } catch (error) {
    history.replaceState(null, '', '#demo');
    say(`${error.message}\nThis is the demo plant.`, 'bad');
    open(kDemo).catch(failure => say(failure.message, 'bad'));
  }
  const choose = element('chooser');
  if (Object.keys(present.files).length) choose.prepend(new Option(`Your ${present.main.replace(/.*\//, '')}`, present.main));
  choose.value = present.main;
}

build();
begin();
ended.then(reason => say(reason, 'bad', 'Restart', () => location.reload()));
addEventListener('hashchange', () => location.reload());
for (const kind of ['dragover', 'dragleave', 'drop'])
  document.addEventListener(kind, event => {
    if (!event.dataTransfer.types.includes('Files')) return;
    event.preventDefault();
    document.body.classList.toggle('over', kind === 'dragover');
    if (kind === 'drop') take(event.dataTransfer.files);
  });
