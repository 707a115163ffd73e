// Draws a scene: fronts, blended sums, picture with light, finish (pinholes, outlines), screen. stx puts the shaders into kShaders.

// A program whose uniforms are set by name; a texture is [texture, target].
class Program {
    constructor(gl, vertex, fragment, pass) {
        this.gl = gl;
        this.program = gl.createProgram();
        for (const [kind, name] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, `#version 300 es\n#define PASS ${pass}\n` + kShaders[name]);
            gl.compileShader(shader);
            gl.attachShader(this.program, shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
                throw new Error(`${name}: ${gl.getShaderInfoLog(shader)}`);
        }
        gl.linkProgram(this.program);
        if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost())
            throw new Error(`${vertex}, ${fragment}: ${gl.getProgramInfoLog(this.program)}`);
        this.uniforms = new Map();
        let units = 0;
        gl.useProgram(this.program);
        for (let i = 0; i < gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS); ++i) {
            const {name, type} = gl.getActiveUniform(this.program, i);
            const at = gl.getUniformLocation(this.program, name), u = {at, type, unit: -1};
            if (/sampler/.test(kSamplers[type] || "")) {
                u.unit = units++;
                gl.uniform1i(at, u.unit);
            }
            this.uniforms.set(name, u);
        }
    }

    use(values) {
        const gl = this.gl;
        gl.useProgram(this.program);
        for (const [name, value] of Object.entries(values)) {
            const u = this.uniforms.get(name);
            if (!u) continue;
            const list = value instanceof Array ? value : [Number(value)];
            if (u.unit >= 0) {
                gl.activeTexture(gl.TEXTURE0 + u.unit);
                gl.bindTexture(value[1], value[0]);
            } else if (u.type === gl.FLOAT_MAT3) gl.uniformMatrix3fv(u.at, false, list);
            else if (u.type === gl.FLOAT_VEC4) gl.uniform4fv(u.at, list);
            else if (u.type === gl.FLOAT_VEC3) gl.uniform3fv(u.at, list);
            else if (u.type === gl.FLOAT_VEC2) gl.uniform2fv(u.at, list);
            else if (u.type === gl.FLOAT) gl.uniform1fv(u.at, list);
            else if (u.type === gl.INT_VEC4) gl.uniform4iv(u.at, list);
            else if (u.type === gl.BOOL_VEC2) gl.uniform2iv(u.at, list);
            else gl.uniform1iv(u.at, list);
        }
    }
}
const kSamplers = {};  // names of the types of textures

class Painter {
    // Errors: what the device lacks, in words.
    constructor(canvas) {
        const gl = canvas.getContext("webgl2", {alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true});
        if (!gl) throw new Error("no WebGL 2");
        this.gl = gl;
        const floats = gl.getExtension("EXT_color_buffer_float");
        if (!floats && !gl.getExtension("EXT_color_buffer_half_float"))
            throw new Error("WebGL 2 is here, but it cannot draw into textures of floats");
        // Sums of 16 bits where those of 32 cannot be blended.
        this.sums = floats && gl.getExtension("EXT_float_blend") ? gl.RGBA32F : gl.RGBA16F;
        for (const name of ["SAMPLER_2D", "SAMPLER_2D_ARRAY", "INT_SAMPLER_2D_ARRAY", "UNSIGNED_INT_SAMPLER_2D_ARRAY"])
            kSamplers[gl[name]] = "sampler";
        const make = (vertex, fragment, pass) => new Program(gl, vertex, fragment, pass);
        this.prepare = make("screen.vert", "prepare.frag", 0);
        this.smooth = make("screen.vert", "smooth.frag", 0);
        this.front = make("splat.vert", "splat.frag", 1);
        this.blend = make("splat.vert", "splat.frag", 2);
        this.resolve = make("screen.vert", "resolve.frag", 0);
        this.pinholes = make("screen.vert", "pinholes.frag", 0);
        this.directions = make("screen.vert", "directions.frag", 0);
        this.outline = make("outline.vert", "outline.frag", 0);
        this.silhouettes = make("screen.vert", "silhouettes.frag", 0);
        this.present = make("screen.vert", "present.frag", 0);
        this.mostSide = gl.getParameter(gl.MAX_TEXTURE_SIZE);
        this.mostReach = gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1] / 2;
        this.blockList = gl.createBuffer();
        this.blockArray = gl.createVertexArray();
        gl.bindVertexArray(this.blockArray);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.blockList);
        gl.enableVertexAttribArray(0);
        gl.vertexAttribIPointer(0, 4, gl.UNSIGNED_INT, 16, 0);
        gl.vertexAttribDivisor(0, 1);
        this.noArray = gl.createVertexArray();
        gl.bindVertexArray(this.noArray);
        this.size = [0, 0];
    }

    // Textures and frames of a picture's size.
    makeTargets(width, height) {
        if (this.size[0] === width && this.size[1] === height) return;
        const gl = this.gl;
        (this.targets || []).forEach((t) => gl.deleteTexture(t));
        (this.frames || []).forEach((f) => gl.deleteFramebuffer(f));
        this.size = [width, height];
        const make = (internal, format, type) =>
            makeTexture(gl, gl.TEXTURE_2D, internal, format, type, width, height, 1);
        const front = make(gl.DEPTH_COMPONENT32F, gl.DEPTH_COMPONENT, gl.FLOAT);
        const type = this.sums === gl.RGBA32F ? gl.FLOAT : gl.HALF_FLOAT;
        const colour = make(this.sums, gl.RGBA, type), normal = make(this.sums, gl.RGBA, type);
        const pictures = [0, 1].map(() => make(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE));
        this.targets = [front, colour, normal, ...pictures];
        const frameOf = (...textures) => {
            const frame = gl.createFramebuffer();
            gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
            textures.forEach((t, i) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, t, 0));
            gl.drawBuffers(textures.map((t, i) => gl.COLOR_ATTACHMENT0 + i));
            return frame;
        };
        const frontFrame = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, frontFrame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, front, 0);
        gl.drawBuffers([gl.NONE]);
        gl.readBuffer(gl.NONE);
        this.frames = [frontFrame, frameOf(colour, normal), frameOf(pictures[0]), frameOf(pictures[1]),
                       frameOf(colour), frameOf(normal)];
        if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE)
            throw new Error(`this device cannot draw into textures of floats of ${width}x${height} pixels`);
    }

    // Blocks that may be in sight, and the farthest distance of any.
    blocksInSight(scene, maps, camera) {
        const list = [];
        let farthest = 1e-30;
        for (const [number, b] of scene.blocks.entries()) {
            const m = maps[b.rectangle];
            let left = Infinity, right = -Infinity, top = Infinity, bottom = -Infinity, near = Infinity, far = -Infinity;
            for (let corner = 0; corner < 8; ++corner) {
                const u = corner & 1 ? b.u1 - 1 : b.u0, v = corner & 2 ? b.v1 - 1 : b.v0, z = corner & 4 ? b.near : b.far;
                const h = [0, 1, 2].map((i) => (m.a0[i] + m.au[i] * u + m.av[i] * v) * z + m.b0[i] + m.bu[i] * u + m.bv[i] * v);
                near = Math.min(near, h[2]);
                far = Math.max(far, h[2]);
                left = Math.min(left, h[0] / h[2]);
                right = Math.max(right, h[0] / h[2]);
                top = Math.min(top, h[1] / h[2]);
                bottom = Math.max(bottom, h[1] / h[2]);
            }
            if (!(far > 0)) continue;
            // What reaches behind the camera may be anywhere; splats reach beyond their points.
            const room = 4 + 3 * Math.max(right - left, bottom - top) / kBlock;
            if (near > 1e-6 * far && (right < -room || bottom < -room || left > camera.width + room || top > camera.height + room)) continue;
            farthest = Math.max(farthest, far);
            list.push(b.u0 | b.v0 << 16, (b.u1 - b.u0) | (b.v1 - b.v0) << 16, b.rectangle, number);
        }
        return {list: new Uint32Array(list), farthest: farthest * 2};
    }

    table(rows, columns, data) {
        const gl = this.gl;
        return makeTexture(gl, gl.TEXTURE_2D, gl.RGBA32F, gl.RGBA, gl.FLOAT, columns, rows, 1, data);
    }

    // The rectangles as shaders/scene.glsl reads them.
    rectangleTable(scene, maps, camera) {
        const columns = Math.ceil(scene.rectangles.length / kTableRows) * kEntry;
        const rows = Math.min(scene.rectangles.length, kTableRows), data = new Float32Array(rows * columns * 4);
        scene.rectangles.forEach((r, i) => {
            const m = maps[i], c = r.camera;
            const eye = into(camera, minus(c.position, camera.position)), forward = into(camera, times(c.axes[2], -1));
            const at = ((i % kTableRows) * columns + Math.floor(i / kTableRows) * kEntry) * 4;
            data.set([...m.a0, c.orthographic ? 1 : 0, ...m.au, c.fx, ...m.av, c.fy, ...m.b0, c.nearPlane, ...m.bu, c.farPlane,
                      ...m.bv, c.dmax, ...eye, r.x + r.page * 65536, ...forward, r.y], at);
        });
        return this.table(rows, columns, data);
    }

    // The views that look at the object from about the camera's side, up to 64 of them.
    viewTable(scene, camera) {
        const ahead = times(camera.axes[2], -1);
        const chosen = scene.covers.map((c) => ({c, cosine: dot(ahead, times(c.view.axes[2], -1))}))
            .sort((a, b) => b.cosine - a.cosine).slice(0, 64).map(({c}) => c);
        const data = new Float32Array(Math.max(1, chosen.length) * 16);
        chosen.forEach(({view, layer}, n) => {
            const m = pixelMap(camera, view);
            data.set([...m.a0, view.orthographic ? 1 : 0, ...m.au, view.width, ...m.av, view.height, ...m.b0, layer], n * 16);
        });
        return {count: chosen.length, texture: this.table(Math.max(1, chosen.length), 4, data)};
    }

    // How many times as wide a picture is drawn: what holds more than 1.5 samples a pixel would flicker.
    factorOf(scene, camera) {
        const ratio = scene.samplesPerPixel(camera);
        if (!(ratio > 1.5)) return 1;
        let factor = Math.round(Math.min(ratio, 16));
        while (factor > 1 && (camera.width * camera.height * factor * factor > 16e6 || Math.max(camera.width, camera.height) * factor > this.mostSide)) --factor;
        return factor;
    }

    // Draws scenes onto the canvas, those behind first. `look`: light, splatSize, background; `quick`: while
    // something moves on a slow device.
    draw(scenes, camera, look, quick) {
        const gl = this.gl;
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.clearColor(...look.background, 1);
        gl.clear(gl.COLOR_BUFFER_BIT);
        for (const scene of scenes.slice().reverse()) this.drawScene(scene, camera, look, quick);
    }

    drawScene(scene, novel, look, quick) {
        const gl = this.gl, two = gl.TEXTURE_2D, array = gl.TEXTURE_2D_ARRAY;
        const factor = quick ? 1 : this.factorOf(scene, novel);
        const camera = Object.assign({}, novel);
        for (const k of ["width", "height", "fx", "fy", "cx", "cy"]) camera[k] *= factor;
        this.makeTargets(camera.width, camera.height);
        const [front, colour, normal, first, second] = this.targets;
        const maps = scene.rectangles.map((r) => pixelMap(r.camera, camera));
        const sight = this.blocksInSight(scene, maps, camera);
        const table = this.rectangleTable(scene, maps, camera), views = this.viewTable(scene, camera);
        const lens = [1 / camera.fx, 1 / camera.fy, camera.cx - 0.5, camera.cy - 0.5];
        const points = {colourTexture: [scene.colour, array], depthTexture: [scene.depth, array], slopeTexture: [scene.slope, array],
                        normalTexture: [scene.normal, array], smoothTexture: [scene.smooth, two], rectangleTable: [table, two], lens,
                        frameSize: [camera.width, camera.height], splatSize: look.splatSize, mostReach: this.mostReach,
                        farthest: sight.farthest};
        gl.viewport(0, 0, camera.width, camera.height);
        gl.bindVertexArray(this.blockArray);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.blockList);
        gl.bufferData(gl.ARRAY_BUFFER, sight.list, gl.STREAM_DRAW);
        const instances = sight.list.length / 4;

        gl.bindFramebuffer(gl.FRAMEBUFFER, this.frames[0]);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LESS);
        gl.clearDepth(1);
        gl.clear(gl.DEPTH_BUFFER_BIT);
        this.front.use(points);
        if (instances) gl.drawArraysInstanced(gl.POINTS, 0, kBlock * kBlock, instances);

        gl.bindFramebuffer(gl.FRAMEBUFFER, this.frames[1]);
        gl.disable(gl.DEPTH_TEST);
        for (const i of [0, 1]) gl.clearBufferfv(gl.COLOR, i, [0, 0, 0, 0]);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE);
        this.blend.use(Object.assign({frontTexture: [front, two]}, points));
        if (instances) gl.drawArraysInstanced(gl.POINTS, 0, kBlock * kBlock, instances);
        gl.disable(gl.BLEND);

        gl.bindVertexArray(this.noArray);
        const pass = (frame, program, values) => {
            gl.bindFramebuffer(gl.FRAMEBUFFER, this.frames[frame]);
            program.use(Object.assign({frontTexture: [front, two], farthest: sight.farthest}, values));
            gl.drawArrays(gl.TRIANGLES, 0, 3);
        };
        pass(2, this.resolve, {
            colourSums: [colour, two], normalSums: [normal, two], lens, worldFromCamera: camera.axes.flat(), eye: camera.position,
            lit: look.light.on, lightDirection: look.light.direction,
            lightAmounts: [look.light.amount, look.light.ambient, look.light.specular, look.light.shininess]});
        const rounds = scene.pruned ? [7, 5, 5] : [7];
        let from = first, to = 3;
        const turn = (program, values) => {
            pass(to, program, Object.assign({pictureTexture: [from, two]}, values));
            [from, to] = to === 3 ? [second, 2] : [first, 3];
        };
        for (const enclosing of rounds) turn(this.pinholes, {enclosing});
        const carve = !quick && views.count > 0;
        // The sums are in the picture now: their textures hold which way the outline runs, and where.
        if (carve) {
            pass(4, this.directions, {pictureTexture: [from, two]});
            gl.bindFramebuffer(gl.FRAMEBUFFER, this.frames[5]);
            gl.clearBufferfv(gl.COLOR, 0, [-9, -9, 0, 0]);
            gl.enable(gl.BLEND);
            gl.blendEquationSeparate(gl.MAX, gl.FUNC_ADD);
            gl.blendFunc(gl.ONE, gl.ONE);
            gl.bindVertexArray(this.blockArray);
            this.outline.use(Object.assign({directionTexture: [colour, two]}, points));
            if (instances) gl.drawArraysInstanced(gl.POINTS, 0, kBlock * kBlock, instances);
            gl.bindVertexArray(this.noArray);
            gl.blendEquation(gl.FUNC_ADD);
            gl.disable(gl.BLEND);
        }
        turn(this.silhouettes, {directionTexture: [colour, two], outlineTexture: [normal, two], coverTexture: [scene.cover, array], viewTable: [views.texture, two], viewCount: views.count,
                                pixelSize: 1 / Math.min(camera.fx, camera.fy), carve, hasGlass: scene.hasGlass});
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, novel.width, novel.height);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        this.present.use({pictureTexture: [from, two], factor});
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.disable(gl.BLEND);
        gl.deleteTexture(table);
        gl.deleteTexture(views.texture);
    }
}
