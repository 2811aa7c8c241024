// What all pages have: their elements, notices, the connection that they show, and keys.

import { Connection } from './connection.js';

export const MARKS = { good: '✓', bad: '!', wait: '…' };  // of verdicts
const NOTICE_MS = 8000;  // that a notice is shown
const FIELDS = 'input, select, textarea';
const PRESSED = 'button, summary';
let noticeTimer = 0;

export const el = (id) => document.getElementById(id);
export const create = (tag, properties = {}) => Object.assign(document.createElement(tag), properties);
export const lines = (tag, texts) => texts.map((textContent) => create(tag, { textContent }));
export const spoken = (name) => name.replace(/[_-]/g, ' ');  // of a posture
export const bytesOf = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));

// Line on what the page was asked for; unlike an alert it goes by itself.
export function showNotice(text) {
  clearTimeout(noticeTimer);
  el('notice').textContent = text;
  if (text) noticeTimer = setTimeout(() => showNotice(''), NOTICE_MS);
}

// Connect to the server; the body shows whether there is a connection, and a badge where the page has one: `open`.
// onChange, patient: see `Connection`.
export function connect(handlers, { open = 'connected', onChange = () => {}, patient = false } = {}) {
  return new Connection({ notice: ({ text }) => showNotice(text), ...handlers }, (connected) => {
    document.body.classList.toggle('disconnected', !connected);
    if (el('connection')) el('connection').textContent = connected ? open : 'not connected';
    onChange(connected);
  }, patient);
}

// Call `act`, or `withControl`, with keys that are not typed into a field and do not press what has the focus.
// They return whether the key was one of theirs.
export function onKey(act, withControl = () => false) {
  addEventListener('keydown', (event) => {
    const { key, target } = event;
    if (event.defaultPrevented || event.altKey || target.matches?.(FIELDS)) return;
    if ((key === ' ' || key === 'Enter') && target.matches?.(PRESSED)) return;
    if ((event.ctrlKey || event.metaKey ? withControl : act)(event)) event.preventDefault();
  });
}
