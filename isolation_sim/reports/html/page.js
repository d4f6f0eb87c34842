"use strict";
// Draws the charts and lets them follow each other, the legend and the fields.
(() => {
  const plots = [...document.querySelectorAll(".plot")];
  // a finger that moves over a chart scrolls the page
  const touch = matchMedia("(pointer: coarse)").matches;
  const options = {
    responsive: true, displaylogo: false, doubleClick: "reset", displayModeBar: touch ? false : "hover",
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]],
  };
  const linked = (link) => plots.filter((plot) => plot.dataset.link === link);
  const axesOf = { time: ["xaxis"], loop: ["xaxis", "yaxis"] };
  const hidden = new Set();
  const shown = (trace) => !hidden.has(trace.meta);

  function rangesOf(plot, axes) {
    const update = {};
    for (const axis of axes) update[`${axis}.range`] = [...plot.layout[axis].range];
    return update;
  }

  const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

  // what a chart shows is passed on to those that show something else; so it ends
  function follow(plot) {
    const axes = axesOf[plot.dataset.link];
    if (!axes) return;
    const update = rangesOf(plot, axes);
    for (const other of linked(plot.dataset.link)) {
      if (other !== plot && other.layout && !same(rangesOf(other, axes), update)) Plotly.relayout(other, { ...update });
    }
    if (plot.dataset.link === "time") tell(update["xaxis.range"]);
  }

  // the unit of an axis stands at the end of its title, or is the title
  const unitOf = (axis) => /\(([^()]*)\)$/.exec(axis?.title?.text ?? "")?.[1] ?? (/^\S{1,6}$/.exec(axis?.title?.text ?? "")?.[0] ?? "");
  const axisOf = (layout, name, kind) => layout[(name ?? kind).replace(/^([xy])/, "$1axis")];
  function explain(trace, layout) {
    if (trace.hovertemplate || trace.hoverinfo || trace.type !== "scatter") return;
    const units = ["x", "y"].map((kind) => unitOf(axisOf(layout, trace[`${kind}axis`], kind)));
    trace.hovertemplate = `%{x:.4g} ${units[0]}, %{y:.4g} ${units[1]}<extra>${trace.name ?? ""}</extra>`;
  }

  // colours of a dark page; lines that would vanish there become light
  const darkness = matchMedia("(prefers-color-scheme: dark)");
  const light = (colour) => {
    const parts = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(colour?.replace?.(/^#(.)(.)(.)$/, "#$1$1$2$2$3$3") ?? "");
    if (!parts) return colour;
    const [r, g, b] = parts.slice(1).map((part) => parseInt(part, 16));
    if (0.299 * r + 0.587 * g + 0.114 * b > 110) return colour;
    return `#${[r, g, b].map((part) => Math.round(part + 0.62 * (255 - part)).toString(16).padStart(2, "0")).join("")}`;
  };
  function paint(plot, dark) {
    const ink = dark ? "#e6e6e6" : "#1b1b1b", update = { "font.color": ink, paper_bgcolor: dark ? "#15191d" : "#fff", plot_bgcolor: dark ? "#15191d" : "#fff" };
    for (const key of Object.keys(plot.layout)) {
      if (/^[xy]axis\d*$/.test(key)) Object.assign(update, { [`${key}.gridcolor`]: dark ? "#33383d" : "#e4e4e4", [`${key}.linecolor`]: dark ? "#8a8a8a" : "#777" });
    }
    plot.data.forEach((trace, k) => {
      plot.kept ??= [];
      plot.kept[k] ??= { line: trace.line?.color, marker: trace.marker?.color, text: trace.textfont?.color };
      const { line, marker } = plot.kept[k], change = {};
      if (typeof line === "string") change["line.color"] = dark ? light(line) : line;
      if (typeof marker === "string") change["marker.color"] = dark ? light(marker) : marker;
      if (Object.keys(change).length) Plotly.restyle(plot, change, [k]);
    });
    return Plotly.relayout(plot, update);
  }
  function paintAll(dark) {
    if (dark || plots.some((plot) => plot.kept)) plots.forEach((plot) => paint(plot, dark));
    for (const sample of document.querySelectorAll(".choice svg *, .key svg line, .key svg text")) {
      for (const name of ["stroke", "fill"]) {
        const original = (sample.dataset[name] ??= sample.getAttribute(name) ?? "");
        if (original) sample.setAttribute(name, dark ? light(original) : original);
      }
    }
  }

  const drawn = plots.map((plot) => {
    const figure = JSON.parse(plot.nextElementSibling.textContent);
    if (touch) figure.layout.dragmode = false;
    figure.data.forEach((trace) => explain(trace, figure.layout));
    // toolbars are for the mouse: what they do, keys do elsewhere
    const quiet = () => plot.querySelectorAll(".modebar-btn").forEach((button) => { button.tabIndex = -1; });
    return Plotly.newPlot(plot, figure.data, figure.layout, options).then(() => {
      plot.on("plotly_relayout", () => follow(plot));
      plot.on("plotly_afterplot", quiet);
      quiet();
    });
  });
  Promise.all(drawn).then(() => { if (darkness.matches) paintAll(true); });
  darkness.addEventListener("change", () => paintAll(darkness.matches));

  // data of a chart as CSV, the figure as SVG
  const quoted = (value) => (/[",\n]/.test(String(value)) ? `"${String(value).replaceAll('"', '""')}"` : String(value));
  const titleOf = (plot) => plot.closest("figure").querySelector("figcaption").textContent.trim();
  function tableOf(plot) {
    const rows = [["line", plot.layout.xaxis?.title?.text || "x", plot.layout.yaxis?.title?.text || "y"]];
    for (const trace of plot._fullData) {
      const n = trace._length ?? trace.y?.length ?? 0;
      for (let k = 0; k < n; k += 1) {
        const x = trace.x ? trace.x[k] : trace.x0 + k * trace.dx, y = trace.y?.[k];
        if (y !== undefined) rows.push([trace.name, x, y]);
      }
    }
    return rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
  }
  function hand(text, type, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
  for (const button of document.querySelectorAll("[data-get]")) {
    button.addEventListener("click", async () => {
      const plot = button.closest("figure").querySelector(".plot");
      const stem = titleOf(plot).replace(/\W+/g, "_").replace(/^_+|_+$/g, "").toLowerCase() || "chart";
      if (button.dataset.get === "csv") return hand(tableOf(plot), "text/csv", `${stem}.csv`);
      const { width, height } = plot.getBoundingClientRect();
      const address = await Plotly.toImage(plot, { format: "svg", width, height });
      hand(decodeURIComponent(address.slice(address.indexOf(",") + 1)), "image/svg+xml", `${stem}.svg`);
    });
  }

  // the section in view is marked in the navigation, and stays in sight there
  const links = [...document.querySelectorAll("nav a")];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      const list = document.querySelector("nav ul");
      for (const link of links) {
        if (link.hash === `#${entry.target.id}`) {
          link.setAttribute("aria-current", "true");
          list.scrollLeft = link.offsetLeft - list.offsetLeft - 40;
        } else link.removeAttribute("aria-current");
      }
    }
  }, { rootMargin: "-10% 0px -80% 0px" });
  document.querySelectorAll("main section").forEach((section) => seen.observe(section));

  const form = document.querySelector(".timerange");
  function tell([start, stop]) {
    if (!form) return;
    form.elements.start.value = +start.toFixed(3);
    form.elements.stop.value = +stop.toFixed(3);
  }
  function show(start, stop) {
    for (const plot of linked("time")) Plotly.relayout(plot, { "xaxis.range": [start, stop] });
  }
  form?.addEventListener("submit", (event) => {
    event.preventDefault();
    const start = form.elements.start.valueAsNumber, stop = form.elements.stop.valueAsNumber;
    const valid = start < stop;
    form.elements.stop.setCustomValidity(valid ? "" : "The end has to come after the start.");
    if (valid) show(start, stop);
    else form.reportValidity();
  });
  form?.addEventListener("input", () => form.elements.stop.setCustomValidity(""));
  form?.addEventListener("reset", () => show(+form.dataset.start, +form.dataset.stop));

  for (const box of document.querySelectorAll("[data-line]")) {
    box.addEventListener("change", () => {
      if (box.checked) hidden.delete(box.dataset.line);
      else hidden.add(box.dataset.line);
      for (const plot of plots) {
        const numbers = plot.data.flatMap((trace, k) => (trace.meta === box.dataset.line ? [k] : []));
        if (numbers.length) Plotly.restyle(plot, { visible: numbers.map((k) => shown(plot.data[k])) }, numbers);
      }
    });
  }

  for (const block of document.querySelectorAll(".tableblock:has(.filters)")) {
    const choices = [...block.querySelectorAll("select")], rows = [...block.querySelectorAll("tbody tr")];
    block.addEventListener("change", () => {
      for (const row of rows) {
        row.hidden = choices.some((c) => c.value && row.children[c.dataset.column].firstChild.data.trim() !== c.value);
      }
      const kept = new Set(rows.filter((row) => !row.hidden).map((row) => row.firstElementChild.textContent.trim()));
      block.querySelector("output").value = `${rows.filter((row) => !row.hidden).length} of ${rows.length} rows`;
      // points of charts that stand for a row of some table follow it
      for (const plot of plots) {
        plot.data.forEach(({ ids }, trace) => {
          if (!ids) return;
          const selected = [...ids.keys()].filter((k) => kept.has(ids[k]));
          Plotly.restyle(plot, { selectedpoints: [selected] }, [trace]);
        });
      }
    });
  }

  // paper has another width than the window, and room for three rows of loops or four time histories
  const heights = plots.map((plot) => parseFloat(plot.style.height));
  addEventListener("beforeprint", () => { if (darkness.matches) paintAll(false); });
  addEventListener("afterprint", () => { if (darkness.matches) paintAll(true); });
  addEventListener("beforeprint", () => plots.forEach((plot, k) => {
    const [width, most] = plot.closest(".gallery") ? [330, 255] : [680, plot.dataset.link === "time" ? 180 : Infinity];
    const height = Math.min(heights[k], most);
    plot.style.height = `${height}px`;
    Plotly.relayout(plot, { width, height });
  }));
  addEventListener("afterprint", () => plots.forEach((plot, k) => {
    plot.style.height = `${heights[k]}px`;
    Plotly.relayout(plot, { width: null, height: null, autosize: true });
  }));
})();
