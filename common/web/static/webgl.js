// Thin layer over WebGL 2: programs by name, meshes, and uniforms from plain values.

const SEGMENTS = 28;  // around a capsule
const CAP_RINGS = 7;

export class Renderer {
  // sources: vertex and fragment shader by name.
  constructor(gl, sources) {
    this.gl = gl;
    this.programs = {};
    for (const [name, [vertex, fragment]] of Object.entries(sources)) this.programs[name] = this.program(vertex, fragment);
  }

  // Select a program and set its uniforms.
  use(name, values) {
    const gl = this.gl;
    const { program, uniforms } = this.programs[name];
    gl.useProgram(program);
    for (const [key, value] of Object.entries(values)) {
      const { at, type } = uniforms[key];
      if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(at, false, value);
      else if (type === gl.FLOAT) gl.uniform1f(at, value);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(at, value);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(at, value);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(at, value);
      else gl.uniform1i(at, value);
    }
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || 'shader');
    const uniforms = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name, type } = gl.getActiveUniform(program, k);
      uniforms[name] = { at: gl.getUniformLocation(program, name), type };
    }
    return { program, uniforms };
  }

  // Mesh of interleaved vertices.  sizes: numbers per attribute.
  mesh(data, sizes) {
    const gl = this.gl;
    const array = gl.createVertexArray();
    const buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    const stride = 4 * sizes.reduce((a, b) => a + b);
    let offset = 0;
    sizes.forEach((size, at) => {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, stride, offset);
      offset += 4 * size;
    });
    return { array, buffer };
  }

  fill({ buffer }, data) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, this.gl.DYNAMIC_DRAW);
  }

  draw({ array }, kind, count) {
    this.gl.bindVertexArray(array);
    this.gl.drawArrays(kind, 0, count);
  }

  // Square texture to draw into.
  target(side) {
    const gl = this.gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, side, side, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    this.setLinearFilter();
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return { texture, frame };
  }

  // Interpolate the bound texture linearly and clamp it at its edges.
  setLinearFilter() {
    const gl = this.gl;
    for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
      gl.texParameteri(gl.TEXTURE_2D, key, value);
  }

  // Unit capsule of rings: the near cap from its pole, then the far cap to its pole.
  capsuleMesh() {
    const gl = this.gl;
    const rows = [];
    for (let k = 0; k <= CAP_RINGS; k++) rows.push([0, (k / CAP_RINGS - 1) * (Math.PI / 2)]);
    for (let k = 0; k <= CAP_RINGS; k++) rows.push([1, (k / CAP_RINGS) * (Math.PI / 2)]);
    const data = rows.flatMap(([end, angle]) => [...Array(SEGMENTS + 1).keys()].flatMap((n) => {
      const turn = (2 * Math.PI * (n % SEGMENTS)) / SEGMENTS;  // the last vertex equals the first exactly, so that no gap shows
      return [Math.cos(turn), Math.sin(turn), end, Math.cos(angle), Math.sin(angle)];
    }));
    const mesh = this.mesh(new Float32Array(data), [2, 3]);
    const faces = [];
    for (let row = 0; row + 1 < rows.length; row++)
      for (let n = 0; n < SEGMENTS; n++) {
        const a = row * (SEGMENTS + 1) + n;
        faces.push(a, a + SEGMENTS + 1, a + 1, a + 1, a + SEGMENTS + 1, a + SEGMENTS + 2);
      }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(faces), gl.STATIC_DRAW);
    return { array: mesh.array, count: faces.length };
  }
}
