// The picture of a camera in which points are placed: zoom, marks, magnifier, keys.

const MOST_ZOOM = 24;
const CLICK_PX = 4;  // a pointer that moved less has clicked
const REACH_PX = { mouse: 12, pen: 16, touch: 26 };  // around a mark, in which a pointer takes it
const MAGNIFIED = 8;
const COLOURS = { pick: '#ffc14d', selected: '#4fd6c0', expected: '#4fb0ff', suspect: '#ff5a68' };

export class PointStage {
  // handlers: onPlace(point or null, [x, y]), onSelect(point), onRemove(point), onStep(by), onCamera(by).
  constructor(canvas, magnifier, handlers) {
    Object.assign(this, { canvas, magnifier, handlers });
    this.image = null;
    this.marks = [];
    this.lines = false;
    this.view = { zoom: 1, x: 0, y: 0 };  // x, y: pixel of the picture in the middle
    this.pointers = new Map();
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener('keydown', (event) => this.key(event));
  }

  // Picture (an image or null) of `size` px; `whole`: show all of it.
  setPicture(image, size, whole) {
    this.image = image;
    this.size = size;
    if (size && whole) this.view = { zoom: 1, x: (size[0] - 1) / 2, y: (size[1] - 1) / 2 };
    this.draw();
  }

  // marks: { name, pick, expected, suspect, selected }; lines: whether the middle columns and rows are drawn.
  setMarks(marks, lines) {
    this.marks = marks;
    this.lines = lines;
    this.draw();
  }

  get selected() { return this.marks.find(({ selected }) => selected); }

  get scale() {  // css px of a pixel
    const { clientWidth, clientHeight } = this.canvas;
    return this.size ? Math.min(clientWidth / this.size[0], clientHeight / this.size[1]) * this.view.zoom : 1;
  }

  toScreen([x, y]) {
    return [this.canvas.clientWidth / 2 + (x - this.view.x) * this.scale, this.canvas.clientHeight / 2 + (y - this.view.y) * this.scale];
  }

  toPixel([x, y]) {
    return [this.view.x + (x - this.canvas.clientWidth / 2) / this.scale, this.view.y + (y - this.canvas.clientHeight / 2) / this.scale];
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  zoomBy(factor, at = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2]) {
    if (!this.size) return;
    const before = this.toPixel(at);
    this.view.zoom = Math.min(MOST_ZOOM, Math.max(1, this.view.zoom * factor));
    const after = this.toPixel(at);
    this.view.x += before[0] - after[0];
    this.view.y += before[1] - after[1];
    this.draw();
  }

  whole() { this.setPicture(this.image, this.size, true); }

  wheel(event) {
    event.preventDefault();
    this.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.002)), this.place(event));
  }

  near(at, reach) {
    const found = this.marks.filter(({ pick }) => pick).map((mark) => {
      const [x, y] = this.toScreen(mark.pick);
      return [Math.hypot(x - at[0], y - at[1]), mark];
    }).filter(([away]) => away <= reach).sort((one, other) => one[0] - other[0]);
    return found[0]?.[1];
  }

  down(event) {
    if (!this.size || event.button > 0) return;
    this.canvas.setPointerCapture(event.pointerId);
    const at = this.place(event);
    this.pointers.set(event.pointerId, { at, from: at, moved: false });
    if (this.pointers.size === 1) {
      const mark = this.near(at, REACH_PX[event.pointerType] ?? 12);
      this.dragged = mark ? { name: mark.name, pick: mark.pick } : null;
      if (mark) this.handlers.onSelect(mark.name);
    } else this.dragged = null;
  }

  move(event) {
    const one = this.pointers.get(event.pointerId);
    if (!one) return;
    const at = this.place(event);
    const others = [...this.pointers.values()].filter((other) => other !== one);
    if (Math.hypot(at[0] - one.from[0], at[1] - one.from[1]) > CLICK_PX) one.moved = true;
    if (others.length) {  // two fingers: zoom and move
      const [other] = others;
      const distance = (p) => Math.max(20, Math.hypot(p[0] - other.at[0], p[1] - other.at[1]));
      const middle = [(at[0] + other.at[0]) / 2, (at[1] + other.at[1]) / 2];
      this.zoomBy(distance(at) / distance(one.at), middle);
      this.pan((at[0] - one.at[0]) / 2, (at[1] - one.at[1]) / 2);
      one.moved = other.moved = true;
    } else if (this.dragged && one.moved) {
      const by = [(at[0] - one.from[0]) / this.scale, (at[1] - one.from[1]) / this.scale];
      this.handlers.onPlace(this.dragged.name, this.inside([this.dragged.pick[0] + by[0], this.dragged.pick[1] + by[1]]));
    } else if (one.moved) this.pan(at[0] - one.at[0], at[1] - one.at[1]);
    one.at = at;
  }

  up(event) {
    const one = this.pointers.get(event.pointerId);
    this.pointers.delete(event.pointerId);
    if (!one || this.pointers.size || event.type === 'pointercancel') return;
    const dragged = this.dragged;
    this.dragged = null;
    if (one.moved || dragged) return;
    const pixel = this.toPixel(one.at);
    const clipped = this.inside(pixel);
    if (Math.hypot(pixel[0] - clipped[0], pixel[1] - clipped[1]) < 1) this.handlers.onPlace(null, clipped);
  }

  pan(dx, dy) {
    this.view.x -= dx / this.scale;
    this.view.y -= dy / this.scale;
    this.draw();
  }

  inside([x, y]) {
    const clip = (value, count) => Math.round(100 * Math.min(count - 0.5, Math.max(-0.5, value))) / 100;
    return [clip(x, this.size[0]), clip(y, this.size[1])];
  }

  nudge(dx, dy) {
    const mark = this.selected;
    if (!mark || !this.size) return;
    const from = mark.pick ?? this.inside([this.view.x, this.view.y]);
    this.handlers.onPlace(mark.name, this.inside(mark.pick ? [from[0] + dx, from[1] + dy] : from));
  }

  key(event) {
    const step = event.shiftKey ? 10 : event.altKey ? 0.1 : 1;
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (moves[event.key]) this.nudge(...moves[event.key]);
    else if (event.key === 'Enter' || event.key === ' ') this.nudge(0, 0);
    else if (event.key === '+' || event.key === '=') this.toSelected(1.5);
    else if (event.key === '-') this.zoomBy(1 / 1.5);
    else if (event.key === '0') this.whole();
    else if (event.key === 'Delete' || event.key === 'Backspace') this.selected && this.handlers.onRemove(this.selected.name);
    else if (event.key === 'n' || event.key === 'p') this.handlers.onStep(event.key === 'n' ? 1 : -1);
    else if (event.key === 'c') this.handlers.onCamera(1);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  toSelected(factor) {
    const pick = this.selected?.pick;
    if (pick) [this.view.x, this.view.y] = pick;
    this.zoomBy(factor);
  }

  draw() {
    const { canvas } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const pen = canvas.getContext('2d');
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (!this.size) return;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawPicture(pen, (at) => this.toScreen(at), this.scale);
    for (const mark of this.marks) this.drawMark(pen, mark);
    this.magnify();
  }

  drawPicture(pen, toScreen, scale) {
    const [x, y] = toScreen([-0.5, -0.5]);  // pixel centres are at integers
    pen.imageSmoothingEnabled = scale < 3;
    if (this.image) pen.drawImage(this.image, x, y, this.size[0] * scale, this.size[1] * scale);
    if (!this.lines) return;
    const [cx, cy] = toScreen([(this.size[0] - 1) / 2, (this.size[1] - 1) / 2]);
    pen.strokeStyle = 'rgba(255, 90, 104, .85)';
    pen.lineWidth = 1;
    pen.beginPath();
    for (const by of [-0.5 * scale, 0.5 * scale]) {  // the edges of the two middle columns and rows
      pen.moveTo(cx + 2 * by, y); pen.lineTo(cx + 2 * by, y + this.size[1] * scale);
      pen.moveTo(x, cy + 2 * by); pen.lineTo(x + this.size[0] * scale, cy + 2 * by);
    }
    pen.stroke();
  }

  drawMark(pen, { name, pick, expected, suspect, selected }) {
    const colour = suspect ? COLOURS.suspect : selected ? COLOURS.selected : COLOURS.pick;
    pen.lineWidth = 1.5;
    if (expected) {
      const [x, y] = this.toScreen(expected);
      pen.strokeStyle = COLOURS.expected;
      pen.beginPath();
      pen.arc(x, y, 6, 0, 2 * Math.PI);
      if (pick) { pen.moveTo(...this.toScreen(pick)); pen.lineTo(x, y); }
      pen.stroke();
    }
    const at = pick ?? expected;
    if (!at) return;
    const [x, y] = this.toScreen(at);
    if (pick) {
      pen.strokeStyle = colour;
      pen.lineWidth = selected ? 2 : 1.5;
      pen.beginPath();
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
        pen.moveTo(x + 3 * dx, y + 3 * dy);
        pen.lineTo(x + 12 * dx, y + 12 * dy);
      }
      pen.stroke();
    }
    pen.font = `${selected ? '700' : '500'} 13px system-ui, sans-serif`;
    pen.lineWidth = 3;
    pen.strokeStyle = 'rgba(0, 0, 0, .75)';
    pen.strokeText(name, x + 9, y - 8);
    pen.fillStyle = pick ? colour : COLOURS.expected;
    pen.fillText(name, x + 9, y - 8);
  }

  magnify() {
    const { magnifier } = this;
    const pen = magnifier.getContext('2d');
    const side = magnifier.width;
    pen.clearRect(0, 0, side, side);
    const pick = this.selected?.pick;
    if (!pick || !this.image) return;
    this.drawPicture(pen, ([x, y]) => [side / 2 + (x - pick[0]) * MAGNIFIED, side / 2 + (y - pick[1]) * MAGNIFIED], MAGNIFIED);
    pen.strokeStyle = COLOURS.selected;
    pen.lineWidth = 1;
    pen.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      pen.moveTo(side / 2 + 3 * dx, side / 2 + 3 * dy);
      pen.lineTo(side / 2 + 40 * dx, side / 2 + 40 * dy);
    }
    pen.stroke();
  }
}
