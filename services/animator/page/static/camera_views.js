// View of each camera: silhouette, the model's outlines over it, and the preview where the rig sends one.
import { colourOf } from './capsules.js';
import { bytesOf, create } from './page.js';

const PERSON = [226, 232, 242];
const SMALL_PX = 320, LARGE_PX = 640;  // longer side of a view as it is drawn; the large one at least of this
const ON_PROCESSOR = { willReadFrequently: true };  // the scene reads the canvases; twice as fast without a graphics card
const css = ([r, g, b], a = 1) => `rgba(${Math.round(255 * r)},${Math.round(255 * g)},${Math.round(255 * b)},${a})`;

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Decode the silhouette of a view to a picture: the inverse of `zenocap.common.vision.mask_codec`.
export async function decodeMask({ size, region, data }) {
  const [width, height] = size;
  const [left, top, across, down] = region;
  const image = new ImageData(width, height);
  if (!across || !down) return image;
  const packed = bytesOf(data);
  const differences = packed[0] === 1;
  const bits = await inflate(differences ? packed.subarray(1) : packed);
  const stride = (across + 7) >> 3;
  for (let y = 0; y < down; y++)
    for (let b = 0; b < stride; b++) {
      const at = y * stride + b;
      if (differences && y) bits[at] ^= bits[at - stride];
      for (let k = 0; k < 8 && 8 * b + k < across; k++)
        if (bits[at] & (128 >> k)) {
          const p = 4 * ((top + y) * width + left + 8 * b + k);
          image.data.set(PERSON, p);
          image.data[p + 3] = 255;
        }
    }
  return image;
}

class View {
  constructor(viewer, parent) {
    this.viewer = viewer;
    this.card = create('figure', { className: 'view glass empty' });  // empty until the first silhouette
    this.card.dataset.viewer = viewer;
    this.canvas = this.card.appendChild(create('canvas'));
    Object.assign(this.card, { tabIndex: 0, title: 'enlarge this view; Escape makes it small again' });
    this.card.setAttribute('role', 'button');
    this.card.setAttribute('aria-expanded', 'false');
    this.card.setAttribute('aria-label', `view of viewer ${viewer}: enlarge`);
    this.card.onclick = () => this.enlarge(!this.card.classList.contains('large'));
    this.card.onkeydown = (e) => {
      if (e.key === 'Enter' || e.key === ' ') this.card.onclick();
      else if (e.key === 'Escape') this.enlarge(false);
      else return;
      e.preventDefault();
      e.stopPropagation();
    };
    this.caption = this.card.appendChild(create('figcaption'));
    this.caption.innerHTML = '<span class="dot"></span><b></b><span class="role"></span><span class="scale number"></span><span class="score number"></span>';
    this.caption.querySelector('.scale').title = 'Perspective scaling factor: size of the person here to that at the origin';
    this.caption.querySelector('.score').title = 'Matching score of the model and this silhouette, 0 to 1';
    this.caption.querySelector('b').textContent = `viewer ${viewer}`;
    this.advice = this.card.appendChild(create('ul', { className: 'advice-lines', hidden: true }));
    this.mask = create('canvas');   // for the scene too: transparent except for person and outlines
    this.preview = null;
    this.number = 0;
    parent.append(this.card);
  }

  // Show the view as large as the page, or small again; one view at most is large.
  enlarge(large) {
    for (const other of document.querySelectorAll('.view.large')) {
      other.classList.remove('large');
      other.setAttribute('aria-expanded', 'false');
    }
    this.card.classList.toggle('large', large);
    this.card.setAttribute('aria-expanded', String(large));
    this.onSize?.();
  }

  // Returns false when a newer silhouette has been decoded first.
  async show(update, source, drawn) {
    const number = ++this.number;
    const image = await decodeMask(update);
    if (number !== this.number) return false;
    const [width, height] = update.size;
    const large = this.card.classList.contains('large');
    const longer = Math.max(width, height);
    const scale = large ? Math.max(1, Math.round(LARGE_PX / longer)) : SMALL_PX / longer;
    const [across, down] = [width, height].map((px) => Math.round(scale * px));
    const bare = new OffscreenCanvas(width, height);
    bare.getContext('2d', ON_PROCESSOR).putImageData(image, 0, 0);
    Object.assign(this.mask, { width: across, height: down });
    const pen = this.mask.getContext('2d', ON_PROCESSOR);
    pen.imageSmoothingEnabled = true;
    pen.globalAlpha = this.preview && drawn.pictures ? 0.2 : 0.5;
    if (drawn.silhouettes) pen.drawImage(bare, 0, 0, across, down);
    pen.globalAlpha = 1;
    pen.lineWidth = Math.max(2, scale * 0.55);
    pen.lineJoin = 'round';
    for (const { part, corners } of (drawn.outlines && update.outlines[source]) || []) {
      pen.strokeStyle = css(colourOf(part), 0.95);
      pen.beginPath();
      for (let k = 0; k < corners.length; k += 2)
        pen.lineTo(scale * (corners[k] + 0.5), scale * (corners[k + 1] + 0.5));
      pen.closePath();
      pen.stroke();
    }
    this.card.classList.remove('empty');
    this.pictured = drawn.pictures;
    this.draw();
    if (!this.silent) this.caption.querySelector('.role').textContent = update.role;
    this.caption.querySelector('.scale').textContent = update.scale === null ? '' : `×${update.scale.toFixed(2)}`;
    this.caption.querySelector('.score').textContent = update.score === null ? '' : `score ${update.score.toFixed(2)}`;
    return true;
  }

  // What the scene shows: the silhouette, or the camera's picture with it.
  get whole() { return this.preview && this.pictured ? this.canvas : this.mask; }

  draw() {
    const { width, height } = this.mask;
    Object.assign(this.canvas, { width, height });
    const pen = this.canvas.getContext('2d', ON_PROCESSOR);
    pen.fillStyle = '#0b1018';
    pen.fillRect(0, 0, width, height);
    if (this.preview && this.pictured !== false) {
      pen.globalAlpha = 0.85;
      pen.drawImage(this.preview, 0, 0, width, height);
      pen.globalAlpha = 1;
    }
    pen.drawImage(this.mask, 0, 0);
  }
}

export class CameraViews {
  // onPicture: called with viewer, silhouette and whole picture, two canvases, when there are new ones.
  constructor(parent, onPicture) {
    this.parent = parent;
    this.onPicture = onPicture;
    this.views = new Map();
    this.last = new Map();
  }

  view(viewer) {
    if (!this.views.has(viewer)) this.views.set(viewer, new View(viewer, this.parent));
    return this.views.get(viewer);
  }

  async show(update, source, drawn) {
    this.last.set(update.viewer, update);
    const view = this.view(update.viewer);
    view.onSize = () => this.show(this.last.get(update.viewer), source, drawn);
    if (await view.show(update, source, drawn)) this.onPicture(update.viewer, view.mask, view.whole);
  }

  redraw(source, drawn) {
    for (const update of this.last.values()) this.show(update, source, drawn);
  }

  async setPreview({ viewer, jpeg }) {
    const view = this.view(viewer);
    view.preview = await createImageBitmap(new Blob([bytesOf(jpeg)], { type: 'image/jpeg' }));
    if (view.pictured === undefined) return;  // before the first silhouette
    view.draw();
    this.onPicture(viewer, view.mask, view.whole);
  }

  // lines: faults of the camera's images, the worst first; the first is shown, all of them in the large view.
  setAdvice({ viewer, lines }) {
    const { advice } = this.view(viewer);
    advice.hidden = !lines.length;
    advice.replaceChildren(...lines.map(({ code, found, change }) => {
      const line = create('li');
      line.dataset.code = code;
      line.append(create('b', { textContent: `${found}: ` }), change);
      return line;
    }));
  }

  // condition: of a viewer, as in the table of services.  silent: seconds without messages.
  setCondition(viewer, condition, silent) {
    const view = this.view(viewer);
    view.card.dataset.condition = condition;
    view.silent = condition === 'stale' || condition === 'gone';
    if (view.silent)
      view.caption.querySelector('.role').textContent = condition === 'gone' ? 'not running' : `silent for ${silent.toFixed(0)} s`;
  }

  clear() {
    this.views.forEach(({ card }) => card.remove());
    this.views.clear();
    this.last.clear();
  }
}
