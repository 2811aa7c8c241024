// WebSocket to the animator: lists of updates in, commands out; it reconnects by itself.

const FIRST_PAUSE_MS = 250;  // before reconnecting; doubled after every failure
const MAX_PAUSE_MS = 4000;

// WebSocket of this server; the query has the token of the page.
export function socketAt(path, query = location.search) {
  return new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}${query}`);
}

export class Connection {
  // handlers: by type of update.  onChange: called with whether the animator is connected.
  // patient: a list is acknowledged when what its handlers return is done, such as the decoding of a picture.
  constructor(handlers, onChange, patient = false) {
    this.handlers = handlers;
    this.onChange = onChange;
    this.patient = patient;
    this.pause = FIRST_PAUSE_MS;
    this.open();
  }

  open() {
    this.socket = socketAt('/socket');
    this.socket.onopen = () => { this.pause = FIRST_PAUSE_MS; this.onChange(true); };
    this.socket.onmessage = ({ data }) => {
      const results = [];
      try {
        for (const update of JSON.parse(data)) results.push(this.handlers[update.type]?.(update));
      } finally {
        const acknowledge = () => this.send({ type: 'acknowledge' });  // only then more is sent: a slow page is never behind
        if (this.patient) Promise.allSettled(results).then(acknowledge);
        else acknowledge();
      }
    };
    this.socket.onclose = () => {
      this.onChange(false);
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, MAX_PAUSE_MS);
    };
  }

  // Returns false without a connection.
  send(command) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(command));
    return true;
  }
}
