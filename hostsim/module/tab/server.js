// SPDX-License-Identifier: MIT
// In a tab: the page's ways to the plant, which runs in a worker.

const worker = new Worker('worker.js', {type: 'module'});
const listeners = new Map();
let last = 0, end;

/// Resolves with the reason when the plant has ended.
export const ended = new Promise(resolve => { end = resolve; });

worker.onmessage = ({data: {id, ...part}}) => {
  if (!id) return end(part.text);
  listeners.get(id)?.(part);
  if (!part.more) listeners.delete(id);
};
worker.onerror = event => end(event.message ?? 'worker.js cannot be loaded');

/// listen(part) gets each {text, more} of the answer.
function post(call, given, listen) {
  listeners.set(++last, listen);
  worker.postMessage({id: last, call, given});
  return last;
}

const answer = (call, given) => new Promise((resolve, reject) => post(call, given, part => part.error ? reject(new Error(part.error)) : resolve(part)));

/// Starts a plant, {main, files}: the path of its file, or demo, and the texts of its files by their paths. A scenario is played first.
/// Resolves with {report, kind}: what the plant says of its files, or the scenario's outcome, good or bad. Rejects with the plant's words.
export const open = plant => answer('open', plant);
/// The same, but what runs goes on.
export const check = plant => answer('check', plant);

export const server = {
  request: (path, options) => new Promise(resolve => {
    let text = '';
    post('request', {path, ...options}, part => {
      text += part.text;
      if (!part.more) resolve(new Response(text, {status: part.status}));
    });
  }),
  follow: path => {
    let begun = false;
    const id = post('request', {path}, ({text, more}) => {
      if (!more) return source.onerror();
      if (!begun) source.onopen();
      begun = true;
      for (const [, data] of text.matchAll(/^data: (.*)$/gm)) source.onmessage({data});
    });
    const source = {close: () => { if (listeners.delete(id)) post('drop', id, () => {}); }};
    return source;
  },
};
