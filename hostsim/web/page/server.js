// SPDX-License-Identifier: MIT
// The page's only ways to the simulator: a request, as fetch(), and the stream of events, as an EventSource.
// In a tab without a server, hostsim/module/tab/server.js replaces this file.

const kPatience = 300;  // milliseconds
const pause = time => new Promise(resolve => setTimeout(resolve, time));
let before = Promise.resolve();

async function whole(path, options) {
  const response = await fetch(path, options);
  return new Response(await response.text(), {status: response.status});
}

/// One request at a time, so that a page needs two connections; but a command may wait for long.
function request(path, options) {
  const response = before.then(() => whole(path, options));
  before = before.then(() => Promise.race([response.catch(() => {}), pause(kPatience)]));
  return response;
}

export const server = {request, follow: path => new EventSource(path)};
