// A take that is dropped on the page, or chosen as a file: checked here, sent to the animator, and opened there.

import { socketAt } from './connection.js';
import { el } from './page.js';

const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];  // an MCAP file begins so
const PIECE_BYTES = 65536;
const MAX_WAITING_BYTES = 4 * PIECE_BYTES;  // in the socket, before more is read from the file
const WAIT_MS = 10;

export class TakeDrop {
  // onOpen: called when the animator plays the file.
  constructor(onOpen) {
    Object.assign(this, { onOpen, busy: false, depth: 0 });
    el('open-file').onclick = () => el('open-input').click();
    el('open-input').onchange = () => { this.open([...el('open-input').files]); el('open-input').value = ''; };
    const withFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files');
    addEventListener('dragenter', (event) => { if (withFiles(event)) { this.depth++; this.showTarget(); event.preventDefault(); } });
    addEventListener('dragover', (event) => { if (withFiles(event)) event.preventDefault(); });
    addEventListener('dragleave', (event) => { if (withFiles(event)) { this.depth = Math.max(0, this.depth - 1); this.showTarget(); } });
    addEventListener('drop', (event) => {
      this.depth = 0;
      this.showTarget();
      if (!withFiles(event)) return;
      event.preventDefault();
      this.open([...event.dataTransfer.files]);
    });
  }

  showTarget() { el('drop-target').hidden = !this.depth; }

  say(text, problem = false) {
    el('open-text').textContent = text;
    el('open-text').className = problem ? 'problem' : 'muted';
  }

  async open(files) {
    if (this.busy) { this.say('another take is being opened', true); return; }
    if (files.length !== 1) { this.say('one file at a time: a take (.mcap)', true); return; }
    this.busy = true;
    try {
      const problem = await this.check(files[0]) || await this.transfer(files[0]);
      this.say(problem || `${files[0].name} is shown`, Boolean(problem));
      if (!problem) this.onOpen();
    } catch {
      this.say(`${files[0].name}: cannot be read, or is a folder: allowed: a take (.mcap)`, true);
    } finally {
      this.busy = false;
      el('open-text').scrollIntoView({ block: 'nearest' });
    }
  }

  async check(file) {
    if (!file.name.toLowerCase().endsWith('.mcap')) return `${file.name}: is no take: allowed: a file whose name ends with .mcap`;
    const start = new Uint8Array(await file.slice(0, MAGIC.length).arrayBuffer());
    return MAGIC.every((byte, k) => start[k] === byte) ? '' : `${file.name}: is no MCAP file: allowed: a take, recorded or made by zenocap track`;
  }

  // Send a file; resolves to why it was refused, "" for one that is opened.
  transfer(file) {
    return new Promise((resolve, reject) => {
      const query = new URLSearchParams(location.search);
      query.set('name', file.name);
      query.set('size', file.size);
      const socket = socketAt('/drop', `?${query}`);
      let answered = false;
      socket.onmessage = ({ data }) => { answered = true; resolve(data); };
      socket.onclose = () => resolve(`${file.name}: the connection to the animator was closed`);
      socket.onopen = async () => {
        try {
          for (let at = 0; at < file.size && !answered && socket.readyState === WebSocket.OPEN;) {
            if (socket.bufferedAmount > MAX_WAITING_BYTES) { await new Promise((after) => setTimeout(after, WAIT_MS)); continue; }
            socket.send(await file.slice(at, at + PIECE_BYTES).arrayBuffer());
            at = Math.min(file.size, at + PIECE_BYTES);
            this.say(`opening ${file.name}: ${(at / 1e6).toFixed(1)} of ${(file.size / 1e6).toFixed(1)} MB`);
          }
        } catch (error) { reject(error); socket.close(); }
      };
    });
  }
}
