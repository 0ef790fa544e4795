"use strict";
// Pictures of one group share zoom and place, so that flipping compares the same pixels. Keys: 1 … 9 and 0 flip, e shows errors, g
// shows all side by side, + and - change exposure, r resets. They go to the viewer that has the focus, or else to the one under
// the pointer, or else to the one that most of the window shows.
(() => {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const make = (parent, tag, text, kind) => {
    const node = parent.appendChild(document.createElement(tag));
    if (text !== undefined) node.textContent = text;
    if (kind) node.className = kind;
    return node;
  };

  // Nine bits of mantissa for each channel, five of a common exponent.
  const floats = (text) => {
    const raw = bytes(text);
    const words = new DataView(raw.buffer);
    const out = new Float32Array((raw.length / 4) * 3);
    for (let i = 0; i < raw.length / 4; i++) {
      const word = words.getUint32(4 * i, true);
      const unit = Math.pow(2, (word >>> 27) - 24);
      for (let c = 0; c < 3; c++) out[3 * i + c] = ((word >>> (9 * c)) & 511) * unit;
    }
    return out;
  };
  const toSrgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * Math.pow(v, 1 / 2.4) - 0.055);
  // The transfer as a table: 4096 steps are finer than eight bits everywhere but next to black, where the formula is cheap.
  const TABLE = Uint8Array.from({ length: 4097 }, (_, i) => Math.round(255 * toSrgb(i / 4096)));
  const encode = (v) => (v >= 1 ? 255 : v < 0.02 ? Math.round(255 * toSrgb(Math.max(v, 0))) : TABLE[Math.round(v * 4096)]);

  class Viewer {
    constructor(figure) {
      const data = JSON.parse(figure.querySelector("script").textContent);
      Object.assign(this, { figure, width: data.width, height: data.height, decades: data.decades });
      this.scale = bytes(data.scale);
      this.pictures = data.pictures.map((p) => ({
        name: p.name,
        note: p.note,
        values: floats(p.pixels),
        errors: p.errors ? bytes(p.errors) : null,
        buffer: Object.assign(document.createElement("canvas"), { width: data.width, height: data.height }),
        drawn: "",
      }));
      this.initial = { current: 0, side: false, error: false, stops: 0, zoom: 1, x: 0.5, y: 0.5 };
      Object.assign(this, this.initial);
      this.build();
      this.layout();
      new ResizeObserver(() => this.draw()).observe(this.stage);
      figure.viewer = this;
    }

    build() {
      const bar = make(this.figure, "div", undefined, "bar");
      this.buttons = this.pictures.map((p, i) => {
        const key = i < 9 ? `${i + 1} ` : i === 9 ? "0 " : "";
        const button = make(bar, "button", key + p.name);
        button.addEventListener("click", () => this.set({ current: i }));
        return button;
      });
      const toggle = (name, text) => {
        const button = make(bar, "button", text);
        button.addEventListener("click", () => this.set({ [name]: !this[name] }));
        return button;
      };
      this.sideButton = toggle("side", "g side by side");
      this.errorButton = this.pictures.some((p) => p.errors) ? toggle("error", "e errors") : null;
      const label = make(bar, "label", "exposure ");
      this.slider = make(label, "input");
      Object.assign(this.slider, { type: "range", min: -10, max: 10, step: 0.25, value: 0 });
      this.slider.addEventListener("input", () => this.set({ stops: Number(this.slider.value) }));
      this.stops_text = make(label, "output", "0");
      make(bar, "button", "r reset").addEventListener("click", () => this.set(this.initial));
      this.stage = make(this.figure, "div", undefined, "stage");
      this.status = make(this.figure, "div", "", "status");
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const digit = "1234567890".indexOf(event.key);
      const action = {
        e: () => this.errorButton && this.set({ error: !this.error }),
        g: () => this.set({ side: !this.side }),
        r: () => this.set(this.initial),
        "+": () => this.set({ stops: Math.min(10, this.stops + 0.5) }),
        "-": () => this.set({ stops: Math.max(-10, this.stops - 0.5) }),
      }[event.key];
      if (digit >= 0 && event.key !== "" && digit < this.pictures.length) this.set({ current: digit });
      else if (action) action();
      else return;
      event.preventDefault();
    }

    set(change) {
      const layout = "side" in change && change.side !== this.side;
      Object.assign(this, change);
      this.slider.value = this.stops;
      if (layout) this.layout();
      this.draw();
    }

    // One canvas, or one for every picture.
    layout() {
      this.stage.replaceChildren();
      const count = this.side ? this.pictures.length : 1;
      const columns = Math.ceil(Math.sqrt(count));
      this.stage.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
      this.cells = Array.from({ length: count }, (_, i) => {
        const cell = make(this.stage, "div", undefined, "cell");
        const canvas = make(cell, "canvas");
        canvas.style.aspectRatio = `${this.width} / ${this.height}`;
        canvas.style.maxHeight = "75vh";
        this.listen(canvas, i);
        return { canvas, name: make(cell, "span", ""), fixed: this.side ? i : null };
      });
      this.draw();
    }

    shown(cell) {
      return this.pictures[cell.fixed === null ? this.current : cell.fixed];
    }

    // Picture pixels per canvas pixel and the picture point at the canvas's corner.
    view(canvas) {
      const fit = Math.min(canvas.width / this.width, canvas.height / this.height);
      const factor = fit * this.zoom;
      return {
        factor,
        left: canvas.width / 2 - this.x * this.width * factor,
        top: canvas.height / 2 - this.y * this.height * factor,
      };
    }

    point(canvas, event) {
      const box = canvas.getBoundingClientRect();
      const ratio = canvas.width / box.width;
      const { factor, left, top } = this.view(canvas);
      return [((event.clientX - box.left) * ratio - left) / factor, ((event.clientY - box.top) * ratio - top) / factor];
    }

    listen(canvas, index) {
      canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        const [px, py] = this.point(canvas, event);
        const zoom = Math.min(64, Math.max(1, this.zoom * Math.pow(2, -event.deltaY / 300)));
        const k = this.zoom / zoom;
        // The point under the pointer stays there.
        const x = px / this.width, y = py / this.height;
        this.set({ zoom, x: x + (this.x - x) * k, y: y + (this.y - y) * k });
      }, { passive: false });
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        this.grab = this.point(canvas, event);
        this.figure.focus({ preventScroll: true });
      });
      canvas.addEventListener("pointerup", () => (this.grab = null));
      canvas.addEventListener("pointermove", (event) => {
        const [px, py] = this.point(canvas, event);
        if (this.grab) {
          this.set({ x: this.x + (this.grab[0] - px) / this.width, y: this.y + (this.grab[1] - py) / this.height });
        }
        this.tell(this.shown(this.cells[this.side ? index : 0]), Math.floor(px), Math.floor(py));
      });
      canvas.addEventListener("dblclick", () => this.set({ zoom: 1, x: 0.5, y: 0.5 }));
    }

    tell(picture, x, y) {
      if (x < 0 || y < 0 || x >= this.width || y >= this.height) return;
      const i = y * this.width + x;
      const colour = Array.from(picture.values.slice(3 * i, 3 * i + 3), (v) => v.toPrecision(3)).join(" ");
      let text = `${picture.name} at ${x},${y}: ${colour}`;
      if (picture.errors) {
        const code = picture.errors[i], [lo, hi] = this.decades;
        const error = Math.pow(10, lo + (code / 254) * (hi - lo));
        text += code === 255 ? "  not finite" : `  relative squared error ${code === 0 ? "below " : ""}${error.toExponential(1)}`;
      }
      this.status.textContent = text;
    }

    // Eight-bit pixels of a picture, kept until exposure or kind changes.
    fill(picture) {
      const error = this.error && picture.errors;
      const state = error ? "error" : `${this.stops}`;
      if (picture.drawn === state) return;
      picture.drawn = state;
      const context = picture.buffer.getContext("2d");
      const image = context.createImageData(this.width, this.height);
      const out = image.data, gain = Math.pow(2, this.stops), n = this.width * this.height;
      for (let i = 0; i < n; i++) {
        if (error) {
          const code = picture.errors[i];
          for (let c = 0; c < 3; c++) out[4 * i + c] = code === 255 ? (c === 1 ? 255 : 0) : this.scale[3 * code + c];
        } else {
          for (let c = 0; c < 3; c++) out[4 * i + c] = encode(picture.values[3 * i + c] * gain);
        }
        out[4 * i + 3] = 255;
      }
      context.putImageData(image, 0, 0);
    }

    draw() {
      this.stops_text.textContent = `${this.stops > 0 ? "+" : ""}${this.stops}`;
      this.buttons.forEach((b, i) => b.classList.toggle("on", !this.side && i === this.current));
      this.sideButton.classList.toggle("on", this.side);
      if (this.errorButton) this.errorButton.classList.toggle("on", this.error);
      for (const cell of this.cells) {
        const picture = this.shown(cell), canvas = cell.canvas;
        this.fill(picture);
        const ratio = window.devicePixelRatio || 1;
        const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
        const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
        if (canvas.width !== width) canvas.width = width;
        if (canvas.height !== height) canvas.height = height;
        const context = canvas.getContext("2d");
        const { factor, left, top } = this.view(canvas);
        context.fillStyle = "#333";
        context.fillRect(0, 0, canvas.width, canvas.height);
        context.imageSmoothingEnabled = factor < 1;
        context.drawImage(picture.buffer, left, top, this.width * factor, this.height * factor);
        cell.name.textContent = picture.note ? `${picture.name}: ${picture.note}` : picture.name;
      }
    }
  }

  const viewers = Array.from(document.querySelectorAll("figure.viewer"), (figure) => new Viewer(figure));
  // Height of the part of a viewer that can be seen.
  const seen = (viewer) => {
    const { top, bottom } = viewer.figure.getBoundingClientRect();
    return Math.min(bottom, window.innerHeight) - Math.max(top, 0);
  };
  document.addEventListener("keydown", (event) => {
    const shown = viewers.filter((v) => seen(v) > 0);
    const chosen =
      shown.find((v) => v.figure.contains(document.activeElement)) ||
      shown.find((v) => v.figure.matches(":hover")) ||
      shown.reduce((best, v) => (best && seen(best) >= seen(v) ? best : v), undefined);
    if (chosen) chosen.key(event);
  });
})();
