// The page: what stx wrote, the camera, light and time, and everything that people touch.

class Viewer {
    constructor() {
        this.canvas = document.getElementById("canvas");
        this.scenes = new Map();  // number -> Scene, the last used at the end
        this.shown = [];
        this.shownNumbers = this.wantedNumbers = [];  // of scenes; wanted is what showFrame() waits for
        this.frame = 0;
        this.leastKept = 4;  // scenes
        this.pointers = new Map();
        this.quick = false;
        this.slow = false;
        this.notTaken = "";  // what the address has that means nothing, as a sentence
        this.drawn = new Promise((resolve) => (this.firstDrawn = resolve));
    }

    async start() {
        this.data = await inflated(bytesOf("data")).json();
        this.painter = new Painter(this.canvas);
        this.canvas.addEventListener("webglcontextlost", (event) => {
            event.preventDefault();
            this.scenes.clear();
            this.shown = [];
            this.say("The device lost the pictures. Load the page again, where they do not come back.");
        });
        this.canvas.addEventListener("webglcontextrestored", () => {
            this.painter = new Painter(this.canvas);
            this.showFrame(this.frame).then(() => this.say(this.notTaken));
        });
        this.fillPanel();
        this.reset();
        this.readAddress();
        this.connect();
        await this.showFrame(this.frame);
        this.say(this.notTaken);
        this.draw();
        this.firstDrawn();
    }

    say(text, failed) {
        const message = document.getElementById("message");
        message.textContent = text;
        message.className = failed ? "failed" : "";
    }

    fail(error) { this.say("The page cannot be drawn: " + error.message, true); }

    // ---- Time ----

    async sceneOf(number) {
        const known = this.scenes.get(number);
        if (known) {
            this.scenes.delete(number);
            this.scenes.set(number, known);
            return known;
        }
        const image = (k) => decodeImage(bytesOf("image" + k));
        const loading = inflated(bytesOf("scene" + number)).json()
            .then((data) => Scene.load(this.painter.gl, this.painter, data, image));
        this.scenes.set(number, loading);
        const scene = await loading;
        // About 20 bytes a pixel: half a gigabyte of moments.
        const most = Math.max(this.leastKept, Math.floor(25e6 / scene.texels));
        for (const [old, kept] of this.scenes) {
            if (this.scenes.size <= most) break;
            if (this.shownNumbers.includes(old) || this.wantedNumbers.includes(old)) continue;
            this.scenes.delete(old);
            Promise.resolve(kept).then((s) => s.release());
        }
        return scene;
    }

    async showFrame(frame) {
        this.frame = frame;
        const numbers = this.wantedNumbers = this.data.frames[frame];
        const scenes = await Promise.all(numbers.map((n) => this.sceneOf(n)));
        if (this.wantedNumbers !== numbers || this.painter.gl.isContextLost()) return;
        this.shownNumbers = numbers;
        this.shown = scenes;
        document.getElementById("time").value = frame;
        const seconds = this.data.times[frame];
        document.getElementById("time-text").textContent = `${Number(seconds.toFixed(3))} s`;
        this.redraw();
    }

    frameAt(time) {
        let frame = 0;
        while (frame + 1 < this.data.times.length && this.data.times[frame + 1] <= time + this.data.slack) ++frame;
        return frame;
    }

    play(on) {
        // What an older run still waits for ends it.
        const run = this.run = {};
        this.playing = on && this.data.frames.length > 1;
        const button = document.getElementById("play");
        button.textContent = this.playing ? "Stop" : "Play";
        button.setAttribute("aria-pressed", String(this.playing));
        if (!this.playing) return this.writeAddress();
        const first = this.data.times[0], length = this.data.end - first;
        const begun = performance.now() - (this.data.times[this.frame] - first) * 1000;
        const step = async () => {
            if (this.run !== run) return;
            const wanted = this.frameAt(first + (performance.now() - begun) / 1000 % length);
            if (wanted !== this.frame) await this.showFrame(wanted);
            requestAnimationFrame(step);
        };
        requestAnimationFrame(step);
    }

    // ---- Camera ----

    reset() {
        const s = this.data.start, [width, height] = this.canvasSize();
        this.camera = {eye: s.eye.slice(), target: s.target.slice(), up: s.up.slice(), fov: s.fov};
        // An object fits into the narrower side.
        if (s.around && width < height) this.zoom(height / width);
    }

    // How far a drag over the whole picture goes.
    orbit(right, down) {
        const c = this.camera, up = unit(c.up), {eye, target, turn} = this.data.start, pivot = turn ? target : c.target;
        let arm = turned(minus(c.eye, pivot), up, -right);
        const across = cross(up, arm), side = lengthOf(across) > 1e-9 * lengthOf(arm) ? unit(across) : lookAt(c, 1, 1).axes[0];
        const angle = Math.acos(Math.max(-1, Math.min(1, dot(unit(arm), up))));
        arm = turned(arm, side, Math.max(0.01, Math.min(Math.PI - 0.01, angle - down)) - angle);
        c.eye = plus(pivot, turn ? armWithin(arm, minus(eye, target), turn) : arm);
    }
    // A single view is turned by a few degrees only: what takes an object around takes it from end to end.
    pace() { return this.data.start.turn || 1; }
    pan(right, down) {
        const c = this.camera, view = lookAt(c, 1, 1), arm = lengthOf(minus(c.eye, c.target));
        const scale = 2 * arm * Math.tan(c.fov * Math.PI / 360);
        const shift = plus(times(view.axes[0], -right * scale), times(view.axes[1], down * scale));
        c.target = plus(c.target, shift);
        if (!this.data.start.turn) return void (c.eye = plus(c.eye, shift));
        // The eye of a single view stays; it looks at what the view shows.
        const {eye, target, fov} = this.data.start, most = lengthOf(minus(eye, target)) * Math.tan(fov * Math.PI / 360);
        const beside = minus(c.target, target), far = lengthOf(beside);
        if (far > most) c.target = plus(target, times(beside, most / far));
    }
    zoom(factor) {
        const c = this.camera, {turn, fov} = this.data.start;
        // From nearer or farther a single view has holes: its angle changes instead, from all of it to an eighth.
        if (turn) return void (document.getElementById("fov").value = c.fov = Math.max(fov / 8, Math.min(fov, c.fov * factor)));
        c.eye = plus(c.target, times(minus(c.eye, c.target), factor));
    }

    // ---- Look ----

    value(id) { return Number(document.getElementById(id).value); }
    // Gives a slider a value, beyond its ends, too.
    setValue(id, value) {
        const slider = document.getElementById(id);
        if (value < Number(slider.min)) slider.min = value;
        if (value > Number(slider.max)) slider.max = value;
        slider.value = value;
        if (id === "splat-size") document.getElementById("splat-text").textContent = Number(value.toFixed(2));
    }
    // Whether a slider has another value than at the start.
    isSet(id) {
        const slider = document.getElementById(id);
        return slider.value !== slider.defaultValue;
    }

    backgroundColour() { return this.background || document.getElementById("background").value; }

    lightDirection() {
        const up = unit(this.data.start.up), back = minus(this.data.start.eye, this.data.start.target);
        const front = unit(minus(back, times(up, dot(back, up))));
        const turn = this.value("light-turn") * Math.PI / 180, height = this.value("light-height") * Math.PI / 180;
        const from = plus(times(turned(front, up, turn), Math.cos(height)), times(up, Math.sin(height)));
        return times(from, -1);
    }

    look() {
        const hex = this.backgroundColour();
        return {
            background: [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255),
            splatSize: this.value("splat-size"),
            light: {on: document.getElementById("light").checked, direction: this.lightDirection(), amount: 1,
                    ambient: this.value("ambient"), specular: this.value("specular"), shininess: 32}};
    }

    canvasSize() {
        if (this.size) return this.size;
        const scale = Math.min(window.devicePixelRatio || 1, 2) * (this.quick && this.slow ? 0.5 : 1);
        return [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => Math.max(1, Math.round(n * scale)));
    }

    draw() {
        const [width, height] = this.canvasSize(), begun = performance.now();
        if (this.canvas.width !== width) this.canvas.width = width;
        if (this.canvas.height !== height) this.canvas.height = height;
        this.painter.draw(this.shown, lookAt(this.camera, width, height), this.look(), this.quick && this.slow);
        // Only a pixel that is read tells when a device is done.
        if (this.quick && !this.slow) {
            this.painter.gl.readPixels(0, 0, 1, 1, this.painter.gl.RGBA, this.painter.gl.UNSIGNED_BYTE, new Uint8Array(4));
            this.slow = performance.now() - begun > 60;
        }
    }

    // Draws soon; what moves is drawn once more, in full, when it stands still.
    redraw(moving) {
        this.quick = Boolean(moving);
        if (!this.waiting) {
            this.waiting = requestAnimationFrame(() => {
                this.waiting = 0;
                try {
                    this.draw();
                } catch (error) {
                    this.fail(error);
                }
            });
        }
        clearTimeout(this.rest);
        if (moving) this.rest = setTimeout(() => (this.redraw(), this.writeAddress()), 250);
    }
    changed() {
        document.getElementById("view").value = "";
        this.redraw(true);
    }

    // ---- Address and command ----

    // A point of the camera's with as many decimals as its distance from what it looks at asks for, wherever
    // the origin is: a hundred millionth of that.
    world(v) {
        const arm = lengthOf(minus(this.camera.eye, this.camera.target));
        const decimals = Math.max(0, Math.min(100, 8 - Math.floor(Math.log10(arm))));
        return plus(v, this.data.origin).map((x) => String(Number(x.toFixed(decimals)))).join(",");
    }
    plain(v) { return v.map((x) => String(Number(x.toPrecision(7)))).join(","); }

    writeAddress() {
        const c = this.camera, parts = [`eye=${this.world(c.eye)}`, `target=${this.world(c.target)}`];
        if (this.plain(c.up) !== this.plain(this.data.start.up)) parts.push(`up=${this.plain(c.up)}`);
        parts.push(`fov=${Number(c.fov.toFixed(4))}`);
        if (this.frame > 0) parts.push(`time=${this.data.times[this.frame]}`);
        if (document.getElementById("light").checked) parts.push(`light=${this.plain(this.lightDirection())}`);
        for (const [name, id] of [["ambient", "ambient"], ["specular", "specular"], ["splat", "splat-size"]])
            if (this.isSet(id)) parts.push(`${name}=${this.value(id)}`);
        const background = this.backgroundColour();
        if (background !== document.getElementById("background").options[0].value) parts.push(`background=%23${background.slice(1)}`);
        if (this.size) parts.push(`size=${this.size.join("x")}`);
        if (document.getElementById("panel").hidden) parts.push("ui=off");
        try {
            history.replaceState(null, "", "#" + parts.join("&"));
        } catch (error) {
            // Some browsers keep the address of local files as it is.
        }
        // What meant nothing is not in it.
        if (this.notTaken && document.getElementById("message").textContent === this.notTaken) this.say("");
        this.notTaken = "";
    }

    // Takes all from the address; what it does not name is as at the start, and so is what means nothing, which notTaken says.
    readAddress() {
        const decoded = (text) => {
            try {
                return decodeURIComponent(text);
            } catch (error) {
                return text;  // a % that codes nothing
            }
        };
        const fields = new Map(location.hash.slice(1).split("&").map((part) => part.split("=").map(decoded)));
        const wrong = [];
        const refuse = (name, expected) => void wrong.push(`${name}=${fields.get(name) || ""} (${expected} is expected)`);
        const numbers = (name, count, expected, possible = () => true) => {
            if (!fields.has(name)) return null;
            const list = (fields.get(name) || "-").split(",").map((text) => text.trim() ? Number(text) : NaN);
            return list.length === count && list.every(Number.isFinite) && possible(list) ? list : refuse(name, expected);
        };
        const point = (name) => numbers(name, 3, "X,Y,Z");
        const direction = (name) => numbers(name, 3, "X,Y,Z, not all of them 0,", (list) => lengthOf(list) > 0);
        const matching = (name, expected, pattern) => {
            const found = (fields.get(name) || "").match(pattern);
            return fields.has(name) && !found ? refuse(name, expected) : found;
        };
        this.notTaken = "";
        const size = matching("size", "WIDTHxHEIGHT, as 640x480,", /^(\d+)x(\d+)$/), most = this.painter.mostSide;
        this.size = size ? [Number(size[1]), Number(size[2])] : null;
        if (size && !this.size.every((side) => side >= 1 && side <= most))
            throw new Error(`#size=${size[0]} is not possible; on this device sides have 1 to ${most} pixels`);
        if (size) Object.assign(this.canvas.style, {width: size[1] + "px", height: size[2] + "px"});
        this.reset();
        const c = this.camera, eye = point("eye"), target = point("target"), up = direction("up");
        const fov = numbers("fov", 1, "one number above 0 and below 180", ([angle]) => angle > 0 && angle < 180);
        if (eye) c.eye = minus(eye, this.data.origin);
        if (target) c.target = minus(target, this.data.origin);
        if (up) c.up = up;
        if (fov) c.fov = fov[0];
        this.setValue("fov", c.fov);
        const time = numbers("time", 1, "one number"), light = direction("light");
        const splat = numbers("splat", 1, "one number above 0", ([factor]) => factor > 0);
        this.frame = time ? this.frameAt(time[0]) : 0;
        for (const id of ["light-turn", "light-height", "ambient", "specular", "splat-size"])
            this.setValue(id, Number(document.getElementById(id).defaultValue));
        if (splat) this.setValue("splat-size", splat[0]);
        document.getElementById("light").checked = false;
        if (light) this.setLight(light);
        for (const name of ["ambient", "specular"]) {
            const amount = numbers(name, 1, "one number, 0 or more,", ([value]) => value >= 0);
            if (amount) this.setValue(name, amount[0]);
        }
        const background = matching("background", "%23rrggbb", /^#[0-9a-f]{6}$/i);
        this.background = background ? background[0] : "";
        document.getElementById("background").selectedIndex = 0;
        document.getElementById("panel").hidden = fields.get("ui") === "off";
        if (wrong.length) this.notTaken = "Not taken from the address: " + wrong.join("; ") + ".";
    }

    // The sliders for a light that travels in a direction.
    setLight(direction) {
        const up = unit(this.data.start.up), from = unit(times(direction, -1));
        const back = minus(this.data.start.eye, this.data.start.target);
        const front = unit(minus(back, times(up, dot(back, up)))), side = cross(up, front);
        document.getElementById("light").checked = true;
        this.setValue("light-height", Math.asin(Math.max(-1, Math.min(1, dot(from, up)))) * 180 / Math.PI);
        this.setValue("light-turn", Math.atan2(dot(from, side), dot(from, front)) * 180 / Math.PI);
    }

    command() {
        const quoted = (text) => /^[\w@%+=:,./-]+$/.test(text) ? text : "'" + text.replace(/'/g, "'\\''") + "'";
        const c = this.camera, [width, height] = this.canvasSize(), look = this.look();
        const words = ["stx render", quoted(this.data.input), ...this.data.options.map(quoted), "-o view.png --mode splat",
                       `--eye=${this.world(c.eye)}`, `--target=${this.world(c.target)}`];
        if (this.plain(c.up) !== this.plain(this.data.up)) words.push(`--up=${this.plain(c.up)}`);
        words.push(`--fov ${Number(c.fov.toFixed(4))}`, `--size ${width}x${height}`,
                   `--background ${look.background.map((x) => Number(x.toFixed(4))).join(",")}`);
        if (this.data.frames.length > 1) words.push(`--time ${this.data.times[this.frame]}`);
        if (this.data.without) words.push(`--without ${this.data.without}`);
        if (look.light.on)
            words.push(`--light=dir:${this.plain(look.light.direction)}`, `--ambient ${look.light.ambient}`,
                       `--specular ${look.light.specular}`, `--shininess ${look.light.shininess}`);
        if (this.isSet("splat-size")) words.push("  # splats of their own size: stx render has no other");
        return words.join(" ");
    }

    showCommand() {
        const text = document.getElementById("command-text");
        document.getElementById("command-row").hidden = false;
        text.value = this.command();
        text.focus();
        text.select();
        if (navigator.clipboard) navigator.clipboard.writeText(text.value).catch(() => {});
    }

    // ---- What people touch ----

    fillPanel() {
        const time = document.getElementById("time");
        document.getElementById("time-row").hidden = this.data.frames.length < 2;
        time.max = this.data.frames.length - 1;
        document.getElementById("facts").textContent = this.data.facts;
        const views = document.getElementById("view");
        this.data.cameras.forEach((camera, i) => views.add(new Option(`view ${i}: ${camera.name}`, String(i))));
    }

    connect() {
        const on = (id, event, act) => document.getElementById(id).addEventListener(event, act);
        const keep = () => (this.redraw(), this.writeAddress());
        for (const id of ["light-turn", "light-height", "ambient", "specular"])
            on(id, "input", () => {
                document.getElementById("light").checked = true;
                this.redraw(true);
            });
        on("light", "change", keep);
        on("background", "change", () => (this.background = "", keep()));
        on("light-moves", "change", () => this.moveLight());
        on("splat-size", "input", () => {
            this.setValue("splat-size", this.value("splat-size"));
            this.redraw(true);
        });
        on("fov", "input", () => (this.camera.fov = this.value("fov"), this.changed()));
        on("time", "input", () => (this.play(false), this.showFrame(this.value("time")).then(() => this.writeAddress())));
        on("play", "click", () => this.play(!this.playing));
        on("reset", "click", () => (this.reset(), this.changed()));
        on("command", "click", () => this.showCommand());
        on("view", "change", () => this.fromView(document.getElementById("view").value));
        on("panel", "submit", (event) => event.preventDefault());
        window.addEventListener("hashchange", () => {
            const message = document.getElementById("message"), before = this.notTaken;
            try {
                this.readAddress();
                // Another message stays: of images that are read, of a device that was lost.
                if (message.className === "failed" || message.textContent === before) this.say(this.notTaken);
            } catch (error) {
                this.size = null;
                this.fail(error);
            }
            this.showFrame(this.frame);
        });
        window.addEventListener("resize", () => this.redraw());
        window.addEventListener("keydown", (event) => this.key(event));
        const canvas = this.canvas;
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            this.zoom(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.0015));
            this.changed();
        }, {passive: false});
        canvas.addEventListener("contextmenu", (event) => event.preventDefault());
        canvas.addEventListener("pointerdown", (event) => {
            canvas.setPointerCapture(event.pointerId);
            this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
        });
        for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
        canvas.addEventListener("pointermove", (event) => this.drag(event));
    }

    drag(event) {
        const before = this.pointers.get(event.pointerId);
        if (!before) return;
        const now = [event.clientX, event.clientY], height = this.canvas.clientHeight;
        const right = (now[0] - before[0]) / height, down = (now[1] - before[1]) / height;
        this.pointers.set(event.pointerId, now);
        if (this.pointers.size === 2) {
            // Two fingers: their middle moves the object, their distance the camera.
            const other = [...this.pointers.entries()].find(([id]) => id !== event.pointerId)[1];
            const apart = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
            this.zoom(apart(before) / apart(now));
            this.pan(right / 2, down / 2);
        } else if (event.buttons & 2 || event.shiftKey) this.pan(right, down);
        else this.orbit(right * 4 * this.pace(), down * 4 * this.pace());
        this.changed();
    }

    key(event) {
        if (/^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
        const step = 0.07, turn = this.data.start.turn ? this.data.start.turn / 5 : step, onButton = /^(BUTTON|SUMMARY)$/.test(event.target.tagName);
        const move = (x, y) => (event.shiftKey ? this.pan(-x * step, -y * step) : this.orbit(-x * turn, -y * turn));
        const acts = {
            ArrowLeft: () => move(-1, 0), ArrowRight: () => move(1, 0), ArrowUp: () => move(0, -1), ArrowDown: () => move(0, 1),
            "+": () => this.zoom(0.9), "=": () => this.zoom(0.9), "-": () => this.zoom(1 / 0.9),
            r: () => this.reset(),
            l: () => document.getElementById("light").click(),
            h: () => (document.getElementById("panel").hidden = !document.getElementById("panel").hidden),
            " ": onButton ? null : () => this.play(!this.playing)};
        const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
        if (!act) return;
        event.preventDefault();
        act();
        if (/^(Arrow|[-+=rR])/.test(event.key)) this.changed();
    }

    // The light goes around the object once in eight seconds.
    moveLight() {
        const moves = document.getElementById("light-moves"), slider = document.getElementById("light-turn");
        document.getElementById("light").checked = moves.checked || document.getElementById("light").checked;
        let last = performance.now();
        const step = (now) => {
            if (!moves.checked) return;
            let angle = Number(slider.value) + (now - last) * 360 / 8000;
            if (angle > 180) angle -= 360;
            if (Math.abs(angle - Number(slider.value)) >= 1) {
                slider.value = angle;
                last = now;
                this.redraw(true);
            }
            requestAnimationFrame(step);
        };
        requestAnimationFrame(step);
    }

    // The place of a reference view; its lens as far as one angle says it.
    fromView(number) {
        if (number === "") return;
        // In films cameras may move: as it is now, where that is drawn.
        const first = this.data.cameras[Number(number)];
        const view = this.shown.flatMap((scene) => scene.views).find((v) => v.name === first.name) || first;
        const axes = axesOf(view.orientation);
        const ahead = times(axes[2], -1), c = this.camera;
        // Beside or behind it the middle tells no distance: it is as far as at the start, startOf().
        const {centre, radius} = this.data.start, along = dot(minus(centre, view.position), ahead);
        const reach = along > 1e-9 * radius ? along : radius;
        Object.assign(c, {eye: view.position.slice(), target: plus(view.position, times(ahead, reach)), up: axes[1]});
        if (!view.orthographic) c.fov = 2 * Math.atan(0.5 * view.height / view.fy) * 180 / Math.PI;
        this.redraw();
        this.writeAddress();
    }
}

// The panel comes packed with the program.
document.body.insertAdjacentHTML("afterbegin", kPanel);
document.querySelector("h1").textContent = document.title;
const viewer = new Viewer();
viewer.start().catch((error) => {
    if (error.message !== "no WebGL 2") return viewer.fail(error);
    viewer.say("This page needs WebGL 2, which this browser does not have or has switched off. Current versions of " +
        "Firefox, Chrome, Edge and Safari have it; look whether hardware acceleration is on.", true);
});
