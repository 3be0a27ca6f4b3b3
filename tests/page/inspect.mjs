// SPDX-License-Identifier: MIT
// Checks in the browser: the layout, and the contrast of texts.

/// Elements that extend beyond their card, or the page beyond the window. Scrolling areas may extend downwards.
export function outside() {
  const found = [], room = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > room) found.push(`the page is ${document.documentElement.scrollWidth} of ${room} wide`);
  for (const card of document.querySelectorAll(".card, header, footer")) {
    const frame = card.getBoundingClientRect();
    for (const element of card.querySelectorAll("*")) {
      const { left, right, top, bottom, width } = element.getBoundingClientRect();
      if (width === 0 || element.closest("title, .u-hz, .u-vt, .u-cursor-pt, option")) continue;
      const scrolls = element.closest(".list, #diagram, #node-panel, #node-list");
      const out = left < frame.left - 0.5 || right > frame.right + 0.5 ||
        ((!scrolls || scrolls === element) && (top < frame.top - 0.5 || bottom > frame.bottom + 0.5));
      if (out) found.push(`${card.id || card.tagName}: ${element.tagName}.${element.className.baseVal ?? element.className} "${element.textContent.slice(0, 30)}" ${[left, right, top, bottom].map(Math.round)} of ${[frame.left, frame.right, frame.top, frame.bottom].map(Math.round)}`);
    }
  }
  return found;
}

/// Areas of the plant that have to be scrolled to see all.
export const scrolled = () => ["node-list", "node-panel"].filter((id) => {
  const { scrollHeight, clientHeight } = document.getElementById(id);
  return scrollHeight > clientHeight;
});

/// Heights of the pixels of a chart's lines and areas in one column, a share of its width: 0 at the top, 1 at the bottom. `red`: only those.
export function coloured(host, share, red = false) {
  const canvas = document.querySelector(`${host} canvas`), frame = canvas.getBoundingClientRect();
  const { left, width, top, height } = document.querySelector(`${host} .u-over`).getBoundingClientRect(), scale = canvas.width / frame.width;
  const pixels = canvas.getContext("2d").getImageData((left - frame.left + width * share) * scale, (top - frame.top) * scale, 1, (height + 3) * scale).data;
  const heights = [];
  for (let at = 0; at < pixels.length; at += 4) {
    const [r, g, b, alpha] = pixels.slice(at, at + 4);
    if (alpha > 200 && (red ? r - Math.max(g, b) : Math.max(r, g, b) - Math.min(r, g, b)) > 60) heights.push(at / pixels.length);
  }
  return heights;
}

/// Texts with a contrast below 4.5 to their background (WCAG AA).
export function pale() {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (color) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = color;
    canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data];
  };
  const light = ([r, g, b]) => [r, g, b].map((value) => value / 255)
    .map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4))
    .reduce((sum, value, at) => sum + value * [0.2126, 0.7152, 0.0722][at], 0);
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const color = rgba(getComputedStyle(at).backgroundColor);
      if (color[3] > 250) return color;
    }
    return [255, 255, 255];
  };
  const found = new Set();
  for (const element of document.querySelectorAll("body *")) {
    const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!own || !element.getClientRects().length || element.closest("title, script, option, datalist")) continue;
    const style = getComputedStyle(element);
    const one = light(rgba(element instanceof SVGElement ? style.fill : style.color)), two = light(behind(element));
    const contrast = (Math.max(one, two) + 0.05) / (Math.min(one, two) + 0.05);
    if (contrast < 4.5) found.add(`${contrast.toFixed(2)}: ${element.tagName}.${element.className.baseVal ?? element.className} "${element.textContent.slice(0, 30)}"`);
  }
  return [...found];
}
