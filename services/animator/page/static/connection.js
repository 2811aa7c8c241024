// The one connection to the animator: lists of what is new in, wishes out; it comes back by itself.

const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 4000;

export class Connection {
  // handlers: by the word in `is`.  changed: called with whether the animator is there.
  constructor(handlers, changed) {
    this.handlers = handlers;
    this.changed = changed;
    this.pause = FIRST_PAUSE_MS;
    this.open();
  }

  open() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    this.socket = new WebSocket(`${scheme}://${location.host}/socket${location.search}`);
    this.socket.onopen = () => { this.pause = FIRST_PAUSE_MS; this.changed(true); };
    this.socket.onmessage = ({ data }) => {
      try {
        for (const piece of JSON.parse(data)) this.handlers[piece.is]?.(piece);
      } finally {
        this.wish({ is: 'got' });  // only then is more sent, so that a slow page is never behind
      }
    };
    this.socket.onclose = () => {
      this.changed(false);
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE_MS);
    };
  }

  // False when nobody is there to hear it.
  wish(what) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(what));
    return true;
  }
}
