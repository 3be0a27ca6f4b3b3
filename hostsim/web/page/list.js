// SPDX-License-Identifier: MIT
// A list of rows of equal height, of which only the visible ones are in the document. Arrows, Home, End, Page Up
// and Page Down choose a row, Enter acts on it.

import {make} from './state.js';

let lists = 0;

export class List {
  #items = []; #rows = new Map(); #name = `list${++lists}`; #body = make('div', {className: 'rows', role: 'presentation'});

  /// kind: class of the rows. key(item): its unique key. cells(item): an array of [text, class, title].
  /// mark(item): more classes. choose(item): called when a row is chosen. Enter and a click move the focus to the field
  /// `edit`, Escape moves it back.
  constructor(host, {kind, height = 22, key, cells, mark = () => '', choose = () => {}, edit = null}) {
    Object.assign(this, {host, kind, height, key, cells, mark, choose, edit, chosen: null});
    host.tabIndex = 0;
    host.role = 'listbox';
    if (edit) edit.onkeydown = event => { if (event.key === 'Escape') host.focus(); };
    host.replaceChildren(this.#body);
    host.addEventListener('scroll', () => this.draw());
    host.addEventListener('keydown', event => this.#key(event));
    host.addEventListener('click', event => this.#click(event));
    new ResizeObserver(() => this.draw()).observe(host);
  }

  get items() { return this.#items; }

  /// The visible rows keep their place when others are inserted before them.
  set items(items) {
    const {host, height, key} = this, at = Math.floor(host.scrollTop / height);
    const top = host.scrollTop > 0 && this.#items[at];
    this.#items = items;
    this.#body.style.height = `${items.length * height}px`;
    const now = top ? items.slice(0, at + 2000).findIndex(item => key(item) === key(top)) : -1;
    if (now >= 0 && now !== at) host.scrollTop += (now - at) * height;
    this.draw();
  }

  draw() {
    const {host, height} = this;
    const first = Math.max(0, Math.floor(host.scrollTop / height) - 1);
    const end = Math.min(this.#items.length, first + Math.ceil(host.clientHeight / height) + 3);
    const gone = this.#rows;
    this.#rows = new Map();
    for (let at = first; at < end; ++at) {
      const key = this.key(this.#items[at]);
      const row = gone.get(key) ?? this.#body.appendChild(make('div', {id: `${this.#name}-${key}`, role: 'option'}));
      gone.delete(key);
      this.#rows.set(key, row);
      this.#fill(row, this.#items[at], at);
    }
    for (const row of gone.values()) row.remove();
    const chosen = this.#rows.get(this.chosen);
    if (chosen) host.setAttribute('aria-activedescendant', chosen.id);
    else host.removeAttribute('aria-activedescendant');
  }

  #fill(row, item, at) {
    const chosen = this.key(item) === this.chosen;
    const name = `row ${this.kind} ${this.mark(item)}${chosen ? ' chosen' : ''}`;
    if (row.className !== name) row.className = name;
    row.item = item;
    row.ariaSelected = chosen;
    row.style.top = `${at * this.height}px`;
    row.style.height = `${this.height}px`;
    const cells = this.cells(item);
    const seen = JSON.stringify(cells);
    if (row.seen === seen) return;
    row.seen = seen;
    row.replaceChildren(...cells.map(([text, type = '', title = text]) => make('span', {className: type, title, textContent: text})));
  }

  pick(key, quietly) {
    this.chosen = key;
    const at = this.#items.findIndex(item => this.key(item) === key);
    if (at >= 0) {
      const {host, height} = this;
      if (at * height < host.scrollTop) host.scrollTop = at * height;
      if ((at + 1) * height > host.scrollTop + host.clientHeight) host.scrollTop = (at + 1) * height - host.clientHeight;
      if (!quietly) this.choose(this.#items[at]);
    }
    this.draw();
  }

  #key(event) {
    const page = Math.max(1, Math.floor(this.host.clientHeight / this.height) - 1);
    const by = {ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity}[event.key];
    const at = this.#items.findIndex(item => this.key(item) === this.chosen);
    if (event.key === 'Enter' && at >= 0) this.#edit();
    else if (by && this.#items.length) {
      const to = Math.min(this.#items.length - 1, Math.max(0, at < 0 ? 0 : at + by));
      this.pick(this.key(this.#items[to]));
    } else return;
    event.preventDefault();
  }

  #click(event) {
    const row = event.target.closest('.row');
    if (!row) return;
    this.pick(this.key(row.item));
    this.#edit();
  }

  #edit() {
    this.edit?.focus();
    this.edit?.select();
  }
}

/// Buttons of which one is chosen; arrow keys move the choice.
export function choice(host, words, chosen, call) {
  const buttons = Object.entries(words).map(([key, text]) =>
    make('button', {type: 'button', role: 'radio', value: key, textContent: text, onclick: () => set(key)}));
  function set(key, quietly) {
    for (const button of buttons) {
      button.ariaChecked = button.value === key;
      button.tabIndex = button.value === key ? 0 : -1;
    }
    if (!quietly) call(key);
  }
  host.replaceChildren(...buttons);
  host.onkeydown = event => {
    const by = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (!by) return;
    const next = buttons[(buttons.indexOf(event.target) + by + buttons.length) % buttons.length];
    next.focus();
    set(next.value);
  };
  set(chosen, true);
  return set;
}
