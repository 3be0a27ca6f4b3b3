// SPDX-License-Identifier: MIT
// Saves the last minute, which the server writes as a scenario, as a file.

import {server} from './server.js';
import {make} from './state.js';

export async function saveScenario() {
  const response = await server.request('api/scenario'), text = await response.text();
  if (!response.ok) throw new Error(text);
  const link = make('a', {download: 'last-minute.toml',
    href: URL.createObjectURL(new Blob([text], {type: 'application/toml'}))});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  return text;
}
