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

  for (const plot of plots) {
    const figure = JSON.parse(plot.nextElementSibling.textContent);
    if (touch) figure.layout.dragmode = false;
    Plotly.newPlot(plot, figure.data, figure.layout, options).then(() => plot.on("plotly_relayout", () => follow(plot)));
  }

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
