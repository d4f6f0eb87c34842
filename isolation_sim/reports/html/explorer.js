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
    // runs over a quantity that their controller does not depend on have one result
    const seen = new Set(), order = [];
    for (const k of [...chosen].sort((a, b) => sign * (criterion.values[a] - criterion.values[b]))) {
      const found = [controllers.codes[k], ...criteria.map((c) => c.values[k])].join();
      if (!seen.has(found)) order.push(k);
      seen.add(found);
      if (order.length === data.best) break;
    }
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
    return order;
  }

  // an axis a row, so that names and ends have room on a narrow screen too: in a band, which no line crosses
  const band = 0.36;
  function drawPaths(chosen, criterion, order) {
    const axes = [...fields.map((f) => ({ name: f.name, values: f.values ?? f.codes, groups: f.values ? null : f.groups })),
      ...new Set([...data.paths.map((k) => criteria[k]), criterion])];
    const every = Math.max(1, Math.ceil(chosen.length / data.lines));
    const drawn = controllers.groups.flatMap((_, code) =>
      chosen.filter((k) => controllers.codes[k] === code).filter((k, place) => place % every === 0));
    const ends = axes.map(({ values }) => chosen.reduce(([low, high], k) => [Math.min(low, values[k]), Math.max(high, values[k])], [Infinity, -Infinity]));
    const at = (axis, k) => {
      const [low, high] = ends[axis];
      return high > low ? (axes[axis].values[k] - low) / (high - low) : 0.5;
    };
    const line = (runs) => ({
      x: runs.flatMap((k) => [...axes.flatMap((_, axis) => [at(axis, k), at(axis, k)]), null]),
      y: runs.flatMap(() => [...axes.flatMap((_, axis) => [axis - band, axis]), null]),
      type: "scatter", mode: "lines", hoverinfo: "skip",
    });
    const coloured = controllers.groups.map((name, code) => ({
      ...line(order.filter((k) => controllers.codes[k] === code)), name,
      line: { color: data.looks[code].colour, dash: data.looks[code].dashes || "solid", width: 1.5 },
    }));
    const traces = [{ ...line(drawn), name: "other runs", opacity: 0.4, line: { color: "#aaa", width: 0.8 } }, ...coloured];
    if (order.length) traces.push({ ...line([order[0]]), name: "best", line: { color: data.looks[controllers.codes[order[0]]].colour, width: 4 } });
    draw(paths, traces, (layout) => {
      layout.shapes = axes.map((_, k) => ({ type: "rect", x0: -0.02, x1: 1.02, y0: k - band, y1: k, layer: "above", fillcolor: "#eef0f3", line: { width: 0 } }));
      layout.annotations = axes.map(({ name, groups }, k) => {
        const [low, high] = ends[k];
        const between = chosen.length ? [...new Set([low, high].map((end) => (groups ? groups[end] : told(end))))] : ["no run"];
        return { x: 0, y: k - band / 2, text: `<b>${escaped(name)}</b>: ${between.map(escaped).join(" to ")}`, xanchor: "left", yanchor: "middle", showarrow: false,
          font: { size: 12 } };
      });
      layout.yaxis.range = [axes.length - 1, -band];
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
    const order = best(chosen, criterion, against);
    drawPaths(chosen, criterion, order);
    drawTrade(chosen, criterion, against);
    if (map) drawMap(chosen, criterion, fields[role("across")], fields[role("up")], order[0]);
  }

  root.addEventListener("change", show);
  show();
})();
