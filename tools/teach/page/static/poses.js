// Poses of a take, fetched in chunks as they are needed.

import { bytesOf } from './page.js';

const AHEAD_S = 6;  // before the end of a chunk at which the next one is requested
const NUMBERS = 7;  // of a part: x, y, z, quaternion x, y, z, w

export class Poses {
  // take: entry of the hello.  ask: called with the number of a chunk.  onArrival: called when one has come.
  constructor(take, ask, onArrival) {
    Object.assign(this, { take, ask, onArrival, chunks: new Map(), asked: new Set() });
    this.parts = take.body.parts.length;
  }

  // data: base64 of 16-bit integers, little-endian like every browser's machine.
  receive(chunk, data) {
    this.chunks.set(chunk, new Int16Array(bytesOf(data).buffer));
    this.onArrival();
  }

  // Request again what a lost connection did not bring.
  forgetAsked() { this.asked.clear(); }

  need(chunk) {
    if (chunk < 0 || chunk * this.take.chunk_poses >= this.take.poses || this.asked.has(chunk)) return;
    this.asked.add(chunk);
    if (!this.chunks.has(chunk)) this.ask(chunk);
  }

  // Pose of a time in seconds as the capsules want it; null while it is on its way, or without a person.
  at(time) {
    const { take } = this;
    const row = Math.min(Math.max(Math.round((time - take.pose_start_s) / (take.pose_step_s || 1)), 0), take.poses - 1);
    const chunk = Math.floor(row / take.chunk_poses);
    this.need(chunk);
    if ((row % take.chunk_poses) * take.pose_step_s > take.chunk_poses * take.pose_step_s - AHEAD_S) this.need(chunk + 1);
    const values = this.chunks.get(chunk);
    if (!values) return null;
    const first = (row % take.chunk_poses) * this.parts * NUMBERS;
    const positions = [];
    const quaternions = [];
    let empty = true;
    for (let k = 0; k < this.parts; k++) {
      const at = first + k * NUMBERS;
      for (let n = 0; n < 3; n++) positions.push(values[at + n] / take.position_scale);
      for (let n = 3; n < NUMBERS; n++) { quaternions.push(values[at + n] / take.quaternion_scale); empty &&= !values[at + n]; }
    }
    return empty ? null : { positions, quaternions, lost: [] };
  }
}
