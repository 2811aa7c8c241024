// What each camera sees: silhouette, the model's outline over it, and the preview where the rig sends one.
import { colourOf } from './mannequin.js';

const PERSON = [226, 232, 242];
const css = ([r, g, b], a = 1) => `rgba(${Math.round(255 * r)},${Math.round(255 * g)},${Math.round(255 * b)},${a})`;
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The silhouette of a view as a picture, `common.vision.packing` the other way round.
export async function maskOf({ size, region, data }) {
  const [width, height] = size;
  const [left, top, across, down] = region;
  const image = new ImageData(width, height);
  if (!across || !down) return image;
  const packed = bytesOf(data);
  const differences = packed[0] === 1;
  const bits = await inflated(differences ? packed.subarray(1) : packed);
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
    this.card = document.createElement('figure');
    this.card.className = 'view glass';
    this.card.dataset.viewer = viewer;
    this.canvas = this.card.appendChild(document.createElement('canvas'));
    this.caption = this.card.appendChild(document.createElement('figcaption'));
    this.caption.innerHTML = '<span class="dot"></span><b></b><span class="role"></span><span class="score number"></span>';
    this.caption.querySelector('b').textContent = `viewer ${viewer}`;
    this.mask = document.createElement('canvas');   // for the stage too: transparent but for person and outline
    this.preview = null;
    this.number = 0;
    parent.append(this.card);
  }

  async show(piece, source, wanted) {
    const number = ++this.number;
    const image = await maskOf(piece);
    if (number !== this.number) return false;  // a newer one has overtaken it
    const [width, height] = piece.size;
    const scale = Math.max(1, Math.round(640 / Math.max(width, height)));
    const bare = new OffscreenCanvas(width, height);
    bare.getContext('2d').putImageData(image, 0, 0);
    Object.assign(this.mask, { width: scale * width, height: scale * height });
    const pen = this.mask.getContext('2d');
    pen.imageSmoothingEnabled = true;
    pen.globalAlpha = 0.5;
    if (wanted.silhouettes) pen.drawImage(bare, 0, 0, scale * width, scale * height);
    pen.globalAlpha = 1;
    pen.lineWidth = Math.max(2, scale * 0.55);
    pen.lineJoin = 'round';
    for (const { part, corners } of (wanted.outlines && piece.outlines[source]) || []) {
      pen.strokeStyle = css(colourOf(part), 0.95);
      pen.beginPath();
      for (let k = 0; k < corners.length; k += 2)
        pen.lineTo(scale * (corners[k] + 0.5), scale * (corners[k + 1] + 0.5));
      pen.closePath();
      pen.stroke();
    }
    this.draw();
    if (!this.ill) this.caption.querySelector('.role').textContent = piece.role;
    this.caption.querySelector('.score').textContent = piece.score === null ? '' : piece.score.toFixed(2);
    return true;
  }

  draw() {
    const { width, height } = this.mask;
    Object.assign(this.canvas, { width, height });
    const pen = this.canvas.getContext('2d');
    pen.fillStyle = '#0b1018';
    pen.fillRect(0, 0, width, height);
    if (this.preview) {
      pen.globalAlpha = 0.6;
      pen.drawImage(this.preview, 0, 0, width, height);
      pen.globalAlpha = 1;
    }
    pen.drawImage(this.mask, 0, 0);
  }
}

export class Views {
  // shown: called with viewer and picture when there is a new one.
  constructor(parent, shown) {
    this.parent = parent;
    this.shown = shown;
    this.views = new Map();
    this.last = new Map();
  }

  view(viewer) {
    if (!this.views.has(viewer)) this.views.set(viewer, new View(viewer, this.parent));
    return this.views.get(viewer);
  }

  async show(piece, source, wanted) {
    this.last.set(piece.viewer, piece);
    const view = this.view(piece.viewer);
    if (await view.show(piece, source, wanted)) this.shown(piece.viewer, view.mask);
  }

  again(source, wanted) {
    for (const piece of this.last.values()) this.show(piece, source, wanted);
  }

  async preview({ viewer, jpeg }) {
    this.view(viewer).preview = await createImageBitmap(new Blob([bytesOf(jpeg)], { type: 'image/jpeg' }));
  }

  // condition: of a viewer, as in the table of services.
  condition(viewer, condition, silent) {
    const view = this.view(viewer);
    view.card.dataset.condition = condition;
    view.ill = condition === 'stale' || condition === 'gone';
    if (view.ill)
      view.caption.querySelector('.role').textContent = condition === 'gone' ? 'gone' : `silent for ${silent.toFixed(0)} s`;
  }

  clear() {
    this.views.forEach(({ card }) => card.remove());
    this.views.clear();
    this.last.clear();
  }
}
