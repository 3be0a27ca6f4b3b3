// SPDX-License-Identifier: MIT
// Numbers and states as text.

export const hex = (number, digits = 4) => number.toString(16).toUpperCase().padStart(digits, '0') + 'h';
export const number = new Intl.NumberFormat('en-US').format;
export const objectText = (index, sub) => `${hex(index)}:${sub.toString(16).toUpperCase().padStart(2, '0')}`;
export const nodeText = id => id ? String(id) : 'none';
export const nodeHex = id => id ? hex(id, 2) : '';

/// In the notation of commands.
export const objectWord = object => `0x${object.index.toString(16).toUpperCase().padStart(4, '0')}:${object.sub}`;

export const addressOf = point => {
  const [index, sub] = point.object.split(':').map(Number);
  return {index, sub};
};

export const rounded = ms => number(ms >= 100 ? Math.round(ms) : Math.round(ms * 1000) / 1000);
/// With the unit in which the number says most.
export const duration = ms => ms >= 10000 ? `${number(Math.round(ms / 100) / 10)} s` : ms >= 1 ? `${rounded(ms)} ms` : `${Math.round(ms * 1000)} µs`;

/// Objects whose values CiA writes in hexadecimal: types, identity, errors, COB-IDs, mappings, controlword, statusword.
export const isHexadecimal = (index, sub) => [0x1000, 0x1001, 0x1002, 0x1005, 0x1012, 0x1014, 0x603F, 0x6040, 0x6041].includes(index) ||
  ([0x1003, 0x1018].includes(index) && sub > 0) ||
  (index >= 0x1400 && index <= 0x1BFF && sub > 0 && ((index & 0x200) !== 0 || sub === 1));
export const valueText = (index, sub, value) =>
  isHexadecimal(index, sub) && /^\d+$/.test(value) ? hex(Number(value), index === 0x1001 ? 2 : index >= 0x6000 ? 4 : 8) : value;
/// With the value at the end of a text as CiA writes it: "read node 16 6041h:00 Statusword = 0250h".
export const inHex = text => text.replace(/([0-9A-F]{4})h:([0-9A-F]{2})(.*) = (\d+)$/, (_, index, sub, name, value) =>
  `${index}h:${sub}${name} = ${valueText(parseInt(index, 16), parseInt(sub, 16), value)}`);
export const shortText = value => Number.isInteger(value) || typeof value !== 'number' ? String(value) : value.toPrecision(6);

export function clock(seconds) {
  const two = value => String(Math.floor(value)).padStart(2, '0');
  return `${two(seconds / 3600)}:${two(seconds / 60 % 60)}:${(seconds % 60).toFixed(3).padStart(6, '0')}`;
}

/// Drive states of CiA 402: mask and value of 6041h.
const kDriveStates = [
  [0x4F, 0x00, 'not ready to switch on'], [0x4F, 0x40, 'switch on disabled'], [0x6F, 0x21, 'ready to switch on'],
  [0x6F, 0x23, 'switched on'], [0x6F, 0x27, 'operation enabled'], [0x6F, 0x07, 'quick stop active'],
  [0x4F, 0x0F, 'fault reaction active'], [0x4F, 0x08, 'fault'],
];
export const driveState = word =>
  kDriveStates.find(([mask, value]) => (word & mask) === value)?.[2] ?? hex(word);

/// Bits of 6041h shown as lanes.
export const kStatusBits = [
  [0, 'ready'], [1, 'switched on'], [2, 'enabled'], [3, 'fault'], [5, 'quick stop'], [7, 'warning'],
  [10, 'target'], [12, 'set-point'],
];

export const kServices = {5055: 'read', 5066: 'write'};

/// States of nodes on the page, the worst first, with their colours and letters.
export const kStates = {failed: ['bad', 'F'], missing: ['bad', 'M'], silent: ['bad', 'S'], off: ['', 'X'], stopped: ['wait', 'T'],
  initialising: ['wait', 'I'], 'pre-operational': ['wait', 'P'], operational: ['good', 'O']};

/// The registers of a request: {first, words, writes} from its PDU and the response's, both in hexadecimal.
export function registersOf({function: code, request, response}) {
  const word = (text, byte) => parseInt(text.substr(byte * 2, 4), 16);
  const words = (text, byte) => Array.from({length: (text.length / 2 - byte) >> 1}, (_, at) => word(text, byte + 2 * at));
  if (code === 3 || code === 4) return {first: word(request, 1), words: words(response, 2)};
  if (code === 6) return {first: word(request, 1), words: [word(request, 3)], writes: true};
  if (code === 16) return {first: word(request, 1), words: words(request, 6), writes: true};
  if (code === 23) return {first: word(request, 5), words: words(request, 10), writes: true};
  return {first: 0, words: []};
}
