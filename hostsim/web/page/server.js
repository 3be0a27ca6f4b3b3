// SPDX-License-Identifier: MIT
// The page's only ways to the simulator: a request, as fetch(), and the stream of events, as an EventSource.
// In a tab without a server, hostsim/module/tab/server.js replaces this file.

export const server = {
  request: (path, options) => fetch(path, options),
  follow: path => new EventSource(path),
};
