// Playing a take: which, where in it, how fast.

const el = (id) => document.getElementById(id);

export class Transport {
  // wish: says it to the animator.  turnTo: makes the page show "live" or "take".
  constructor(wish, turnTo) {
    Object.assign(this, { wish, turnTo, last: null, dragging: false });
    el('pause').onclick = () => wish({ is: 'control', paused: !this.last?.paused });
    el('stop').onclick = () => { wish({ is: 'control', stop: true }); this.turnTo('live'); };
    el('speed').onchange = () => wish({ is: 'control', rate: Number(el('speed').value) });
    el('place').oninput = () => { this.dragging = true; this.words(Number(el('place').value)); };
    el('place').onchange = () => {
      this.dragging = false;
      wish({ is: 'control', place_s: Number(el('place').value) });
    };
  }

  play(take) {
    el('player-problem').hidden = true;
    this.wish({ is: 'play', take });
    this.turnTo('take');
  }

  // What the animator says of the take that is being played.
  show(piece) {
    this.last = piece;
    el('player-problem').hidden = !piece.problem;
    el('player-problem').textContent = piece.problem;
    el('transport').hidden = !piece.take;
    if (!piece.take) { this.turnTo('live'); return; }
    el('take-name').textContent = piece.take.replace(/\.mcap$/, '');
    el('pause').textContent = piece.paused ? '▶' : '❚❚';
    el('pause').setAttribute('aria-label', piece.paused ? 'play' : 'pause');
    if (document.activeElement !== el('speed')) el('speed').value = String(piece.rate);
    el('place').max = piece.duration_s;
    if (!this.dragging) { el('place').value = piece.place_s; this.words(piece.place_s); }
  }

  words(place) { el('clock').textContent = `${place.toFixed(1)} / ${(this.last?.duration_s || 0).toFixed(1)} s`; }
}
