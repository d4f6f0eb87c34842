"use strict";
// Two buildings on their isolators; plays only when asked to.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const WIDTH = 360, GROUND = 306, BASE = 262, TOP = 22, HALF = 62;
  const REST = [236, 239, 243], FULL = [27, 12, 66];

  function unpack({ unit, data }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    return Float32Array.from(new Int16Array(bytes.buffer), (step) => step * unit);
  }

  function draw(parent, name, attributes) {
    const element = parent.appendChild(document.createElementNS(SVG, name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  }

  const points = (corners) => corners.map((corner) => corner.map((c) => c.toFixed(1)).join(",")).join(" ");

  function stage(svg, data) {
    draw(svg, "rect", { x: 0, y: GROUND, width: WIDTH, height: 24, fill: "#d9d4cc" });
    draw(svg, "line", { x1: 0, x2: WIDTH, y1: GROUND, y2: GROUND, stroke: "#444", "stroke-width": 2 });
    draw(svg, "line", { x1: WIDTH / 2, x2: WIDTH / 2, y1: TOP, y2: GROUND, stroke: "#999", "stroke-dasharray": "3 4" });
    const places = data.isolated ? [-HALF + 16, 0, HALF - 16] : [];
    const bearings = places.map(() => draw(svg, "polygon", { stroke: "#333" }));
    const walls = draw(svg, "polygon", { fill: "#fff", "fill-opacity": .8, stroke: "#333", "stroke-width": 1.5 });
    const bottom = data.isolated ? BASE : GROUND - 8;
    const storey = (bottom - TOP) / Math.max(data.levels - 1, 1);
    const floors = Array.from({ length: data.levels }, (_, k) =>
      draw(svg, "rect", { width: 2 * HALF, height: k ? 5 : 12, y: bottom - k * storey - (k ? 2 : 6), fill: k ? "#555" : "#222" }));
    return (at, current) => {
      const centre = at.map((each) => WIDTH / 2 + WIDTH * (at[0] * data.sway + (each - at[0]) * data.lean));
      floors.forEach((floor, k) => floor.setAttribute("x", (centre[k] - HALF).toFixed(1)));
      const corner = (side) => centre.map((x, k) => [x + side * (HALF - 6), bottom - k * storey]);
      walls.setAttribute("points", points([...corner(-1), ...corner(1).reverse()]));
      const share = data.largest_A ? Math.max(current, 0) / data.largest_A : 0;
      const tint = REST.map((rest, k) => Math.round(rest + share * (FULL[k] - rest)));
      bearings.forEach((bearing, k) => {
        const foot = WIDTH / 2 + places[k], head = centre[0] + places[k];
        bearing.setAttribute("points", points([[foot - 13, GROUND], [foot + 13, GROUND], [head + 13, BASE + 6], [head - 13, BASE + 6]]));
        bearing.setAttribute("fill", `rgb(${tint})`);
      });
    };
  }

  function strip(svg, data) {
    const ground = unpack(data.ground_m_s2), peak = Math.max(...ground.map(Math.abs)) || 1;
    const x = (frame) => (720 * frame) / (data.frames - 1);
    const line = Array.from(ground, (value, k) => [x(k), 30 - (27 * value) / peak]);
    draw(svg, "polyline", { points: points(line), fill: "none", stroke: "#555", "vector-effect": "non-scaling-stroke" });
    const now = draw(svg, "line", { y1: 0, y2: 60, stroke: "#d55e00", "stroke-width": 2, "vector-effect": "non-scaling-stroke" });
    return (frame) => { now.setAttribute("x1", x(frame)); now.setAttribute("x2", x(frame)); };
  }

  for (const block of document.querySelectorAll(".animation")) {
    const data = JSON.parse(block.querySelector("script").textContent);
    const runs = Object.fromEntries(Object.entries(data.runs).map(([name, run]) => [name, {
      displacement: unpack(run.displacement_mm), current: run.current_A && unpack(run.current_A),
    }]));
    const sides = [...block.querySelectorAll("[data-side]")].map((figure) => ({
      choice: figure.querySelector("select"), caption: figure.querySelector("figcaption"),
      show: stage(figure.querySelector("svg"), data),
    }));
    const cursor = strip(block.querySelector(".strip"), data);
    const [button, slider, speed] = [".play", "[type=range]", ".speed"].map((part) => block.querySelector(part));
    const output = block.querySelector("output");
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    const last = data.frames - 1;
    // at rest it shows the largest motion; played, it begins at the beginning
    let frame = data.largest_at, fresh = true, playing = false, before = 0;

    function show() {
      const k = Math.round(frame), time = `${(data.start_s + k * data.step_s).toFixed(1)} s`;
      for (const { choice, caption, show } of sides) {
        const { displacement, current } = runs[choice.value];
        const at = Array.from({ length: data.levels }, (_, level) => displacement[level * data.frames + k]);
        show(at, current ? current[k] : 0);
        const lean = at[at.length - 1] - at[0];
        caption.textContent = `Base ${at[0].toFixed(1)} mm\nLean ${lean.toFixed(2)} mm`
          + (current ? `\nCurrent ${current[k].toFixed(2)} A` : "");
      }
      cursor(k);
      slider.value = k;
      slider.setAttribute("aria-valuetext", time);
      output.value = time;
    }

    function advance(now) {
      if (!playing) return;
      // a frame may have begun before the button was pressed
      const passed = Math.min(Math.max(now - before, 0), calm.matches ? 5000 : 200) / 1000;
      // whoever wants little motion sees a picture a second
      if (!calm.matches || passed >= 1) {
        before = now;
        frame = Math.min(frame + (passed * speed.value) / data.step_s, last);
        show();
        if (frame >= last) play(false);
      }
      requestAnimationFrame(advance);
    }

    function play(wanted) {
      playing = wanted;
      button.textContent = playing ? "Pause" : "Play";
      if (!playing) return;
      if (fresh || frame >= last) frame = 0;
      fresh = false;
      before = performance.now();
      requestAnimationFrame(advance);
    }

    button.addEventListener("click", () => play(!playing));
    slider.addEventListener("input", () => { frame = slider.valueAsNumber; fresh = false; show(); });
    for (const { choice } of sides) choice.addEventListener("change", show);
    show();
  }
})();
