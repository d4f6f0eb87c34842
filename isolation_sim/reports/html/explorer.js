"use strict";
// Draws those runs of a sweep that the reader has chosen.
(() => {
  const root = document.querySelector(".explorer");
  const data = JSON.parse(root.querySelector(":scope > script").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const numbers = (text) => new Float32Array(bytes(text).buffer);
  const fields = data.fields.map((f) => ({ ...f, codes: bytes(f.codes), values: f.values && numbers(f.values) }));
  const criteria = data.criteria.map((c) => ({ ...c, values: numbers(c.values) }));
  const cases = numbers(data.cases), controllers = fields[data.controller];
  const [paths, trade, map] = root.querySelectorAll(".plot");
  const filters = [...root.querySelectorAll("[data-field]")], output = root.querySelector("output");
  const told = (value) => String(+value.toPrecision(4));
  // the digits of a result stand below each other
  const result = (value) => (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e4 ? value.toPrecision(4).replace(/\.$/, "") : told(value));
  const valueOf = (field, k) => (field.values ? told(field.values[k]) : field.groups[field.codes[k]]);
  const role = (name) => +root.querySelector(`[data-role=${name}]`).value;

  const bases = [paths, trade, map].map((plot) => plot && JSON.stringify(JSON.parse(plot.nextElementSibling.textContent).layout));
  function draw(plot, traces, change) {
    const layout = JSON.parse(bases[[paths, trade, map].indexOf(plot)]);
    change(layout);
    layout.dragmode = plot.layout.dragmode;
    Plotly.react(plot, traces, layout);
  }

  function best(chosen, criterion, against) {
    const sign = criterion.more ? -1 : 1;
    const order = [...chosen].sort((a, b) => sign * (criterion.values[a] - criterion.values[b])).slice(0, data.best);
    const columns = against === criterion ? [criterion] : [criterion, against];
    const cell = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });
    const row = (texts, tag) => {
      const made = document.createElement("tr");
      made.append(...texts.map((text, k) => {
        const each = cell(k && tag === "td" ? "td" : "th", text), field = fields[k - 1];
        if (each.tagName === "TH") each.scope = tag === "td" ? "row" : "col";
        each.classList.toggle("number", k > 0 && (!field || field.values));
        return each;
      }));
      return made;
    };
    root.querySelector("caption").textContent =
      `The ${order.length} runs with the ${criterion.more ? "highest" : "lowest"} ${criterion.name}, of ${chosen.length} chosen`;
    root.querySelector("thead").replaceChildren(row(["case", ...fields.map((f) => f.name), ...columns.map((c) => c.name)], "th"));
    root.querySelector("tbody").replaceChildren(...order.map((k) =>
      row([told(cases[k]), ...fields.map((f) => valueOf(f, k)), ...columns.map((c) => result(c.values[k]))], "td")));
    return order[0];
  }

  // an axis a row, so that names and ends have room on a narrow screen too
  function drawPaths(chosen, criterion, first) {
    const axes = [...fields.map((f) => ({ name: f.name, values: f.values ?? f.codes, groups: f.values ? null : f.groups })),
      ...new Set([...data.paths.map((k) => criteria[k]), criterion])];
    const every = Math.max(1, Math.ceil(chosen.length / data.lines));
    const drawn = chosen.filter((k, place) => place % every === 0 || k === first);
    const ends = axes.map(({ values }) => chosen.reduce(([low, high], k) => [Math.min(low, values[k]), Math.max(high, values[k])], [Infinity, -Infinity]));
    const at = (axis, k) => {
      const [low, high] = ends[axis];
      return high > low ? (axes[axis].values[k] - low) / (high - low) : 0.5;
    };
    const line = (runs) => ({
      x: runs.flatMap((k) => [...axes.map((_, axis) => at(axis, k)), null]),
      y: runs.flatMap(() => [...axes.keys(), null]),
      type: "scatter", mode: "lines", hoverinfo: "skip",
    });
    const traces = controllers.groups.map((name, code) => ({
      ...line(drawn.filter((k) => controllers.codes[k] === code)), name, opacity: 0.45,
      line: { color: data.looks[code].colour, dash: data.looks[code].dashes || "solid", width: 1 },
    }));
    if (first !== undefined) traces.push({ ...line([first]), name: "best", line: { color: "#000", width: 4 } });
    draw(paths, traces, (layout) => {
      layout.shapes = axes.map((_, k) => ({ type: "line", x0: 0, x1: 1, y0: k, y1: k, layer: "below", line: { color: "#777", width: 1 } }));
      layout.annotations = axes.map(({ name, groups }, k) => {
        const [low, high] = ends[k];
        const between = chosen.length ? [...new Set([low, high].map((end) => (groups ? groups[end] : told(end))))] : ["no run"];
        return { x: 0, y: k, text: `<b>${escaped(name)}</b>: ${between.map(escaped).join(" to ")}`, xanchor: "left", yanchor: "bottom", yshift: 2, showarrow: false,
          bgcolor: "rgba(255,255,255,0.85)", borderpad: 1, font: { size: 12 } };
      });
      layout.yaxis.range = [axes.length - 0.7, -0.8];
    });
  }
  const escaped = (text) => String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;");

  function drawTrade(chosen, criterion, against) {
    const traces = controllers.groups.map((name, code) => {
      const runs = chosen.filter((k) => controllers.codes[k] === code);
      return {
        type: "scatter", mode: "markers", name, x: runs.map((k) => against.values[k]), y: runs.map((k) => criterion.values[k]),
        text: runs.map((k) => `case ${told(cases[k])}, ${escaped(name)}`), hovertemplate: "%{text}: %{x:.4g}, %{y:.4g}<extra></extra>",
        marker: { symbol: data.looks[code].symbol, size: 7, opacity: 0.7, color: data.looks[code].colour, line: { color: "#fff", width: 0.5 } },
      };
    });
    draw(trade, traces, (layout) => {
      layout.xaxis.title.text = against.name;
      layout.yaxis.title.text = criterion.name;
    });
  }

  // medians over several controllers would be those of none: without another wish, the best run's
  function drawMap(all, criterion, across, up, first) {
    const apart = across !== controllers && up !== controllers && first !== undefined;
    const code = controllers.codes[first];
    const chosen = apart ? all.filter((k) => controllers.codes[k] === code) : all;
    const cells = up.groups.map(() => across.groups.map(() => []));
    for (const k of chosen) cells[up.codes[k]][across.codes[k]].push(criterion.values[k]);
    const middle = (values) => {
      if (!values.length) return null;
      values.sort((a, b) => a - b);
      const half = values.length >> 1;
      return values.length % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
    };
    const z = cells.map((row) => row.map(middle));
    const printed = across.groups.length <= 6;
    draw(map, [{
      type: "heatmap", x: [...across.groups.keys()], y: [...up.groups.keys()], z, colorscale: data.shades, hoverongaps: false,
      text: z.map((row) => row.map((value) => (value === null ? "" : told(+value.toPrecision(3))))), texttemplate: printed ? "%{text}" : "",
      hovertemplate: "%{text}<extra></extra>", xgap: 1, ygap: 1, colorbar: { thickness: 12, outlinewidth: 0 },
    }], (layout) => {
      for (const [axis, field] of [[layout.xaxis, across], [layout.yaxis, up]]) {
        axis.title.text = escaped(field.name);
        Object.assign(axis, { tickvals: [...field.groups.keys()], ticktext: field.groups.map(escaped), showgrid: false, automargin: true });
      }
      map.closest("figure").querySelector("figcaption").textContent = `Median ${criterion.name} over ${across.name} and ${up.name}${apart ? `, ${controllers.groups[code]}` : ""}`;
    });
  }

  function show() {
    const wanted = filters.map((select) => (select.value === "" ? null : +select.value));
    const chosen = [...cases.keys()].filter((k) => wanted.every((code, f) => code === null || fields[f].codes[k] === code));
    output.value = `${chosen.length} of ${cases.length} runs`;
    const criterion = criteria[role("criterion")], against = criteria[role("against")];
    const first = best(chosen, criterion, against);
    drawPaths(chosen, criterion, first);
    drawTrade(chosen, criterion, against);
    if (map) drawMap(chosen, criterion, fields[role("across")], fields[role("up")], first);
  }

  root.addEventListener("change", show);
  show();
})();
