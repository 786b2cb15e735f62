// What the browser does itself: charts get points (not all options again), colours follow light and dark,
// and what is shown is marked as old when nothing was heard for two seconds.
(() => {
  const OLD_MS = 2500;
  const COLOURS = { // Okabe and Ito's palette, safe for colour blindness; text has at least 4.5:1 on its background
    light: { text: '#1b2733', line: '#b9c3cd', series: ['#0072b2', '#b34700', '#1b2733'], gap: 'rgba(60,70,80,.55)' },
    dark: { text: '#e6edf3', line: '#48525c', series: ['#56b4e9', '#e69f00', '#e6edf3'], gap: 'rgba(190,200,210,.55)' },
  };
  const isDark = () => document.body.classList.contains('body--dark');
  const colours = () => COLOURS[isDark() ? 'dark' : 'light'];
  const strips = {};
  const chartOf = (id) => { const e = getElement(id); return e && e.chart; };

  // Draw an AOI where it was moved to: no corners hide it, and without a place it is where the study has it.
  const placeAoi = (svg, shape, corners) => {
    const label = svg.querySelector(`[data-aoi-name="${shape.dataset.aoi}"]`);
    if (corners === undefined && shape.dataset.own === undefined) return;
    if (shape.dataset.own === undefined) {
      shape.dataset.own = shape.getAttribute('points');
      label.dataset.own = `${label.getAttribute('x')} ${label.getAttribute('y')}`;
    }
    const hidden = corners !== undefined && corners.length === 0;
    for (const element of [shape, label]) element.style.display = hidden ? 'none' : '';
    if (hidden) return;
    const [x, y] = corners ? [100 * Math.min(...corners.map((c) => c[0])) + 1.5, 60 * Math.min(...corners.map((c) => c[1])) + 6]
      : label.dataset.own.split(' ');
    shape.setAttribute('points', corners ? corners.map(([cx, cy]) => `${100 * cx},${60 * cy}`).join(' ') : shape.dataset.own);
    label.setAttribute('x', x); label.setAttribute('y', y);
  };

  const themed = (chart, c = colours()) => {
    const options = chart.getOption();
    const axes = (list) => (list || []).map(() => ({
      axisLabel: { color: c.text }, axisLine: { lineStyle: { color: c.line } },
      splitLine: { lineStyle: { color: c.line } }, nameTextStyle: { color: c.text } }));
    const update = { color: c.series, textStyle: { color: c.text }, legend: { textStyle: { color: c.text } },
      xAxis: axes(options.xAxis), yAxis: axes(options.yAxis) };
    update.series = (options.series || []).map((s) =>
      (s.label && s.label.show ? { label: { color: c.text, textBorderWidth: 0 } } : {}));
    if (options.visualMap && options.visualMap.length) update.visualMap = [{ textStyle: { color: c.text } }];
    chart.setOption(update);
  };
  const allCharts = () => [...document.querySelectorAll('.nicegui-echart')].map((e) => {
    const id = Number(e.id.slice(1)); return chartOf(id); }).filter(Boolean);
  const retheme = () => allCharts().forEach((chart) => themed(chart));

  const drawStrip = (id, nowMs) => {
    const s = strips[id], chart = chartOf(id);
    if (!s || !chart) return;
    const first = nowMs - s.windowMs, c = colours();
    s.points = s.points.filter((p) => p[0] >= first - 5000);
    const mark = (list, kind) => list.filter((m) => m[0] >= first).map(([t, label]) => ({
      xAxis: t, label: { formatter: label, color: c.text, position: kind === 'decision' ? 'end' : 'insideEndTop', show: kind === 'decision' || label !== '' },
      lineStyle: { color: c.text, type: kind === 'decision' ? 'solid' : 'dotted', width: kind === 'decision' ? 1 : 2 } }));
    const range = { min: first, max: nowMs };
    chart.setOption({
      xAxis: [range, range],
      series: [
        { data: s.points.map((p) => [p[0], p[1]]),
          markLine: { symbol: 'none', silent: true, data: [
            { yAxis: s.threshold, label: { formatter: '' }, lineStyle: { color: c.line, type: 'dashed' } },
            ...mark(s.decisions, 'decision'), ...mark(s.markers, 'marker')] },
          markArea: { silent: true, itemStyle: { color: hatch(c.gap) }, data: s.gaps.map(([a, b]) => [{ xAxis: a }, { xAxis: b }]) } },
        { data: s.points.map((p) => [p[0], p[2]]) },
        { data: s.points.filter((p) => p[3]).map((p) => [p[0], p[3]]), itemStyle: { color: c.series[0] },
          symbolSize: [Math.max(3, Math.ceil(500 * (chart.getWidth() - 102) / s.windowMs)), 14] },
      ] });
  };

  const hatches = {};
  const hatch = (colour) => { // a pattern of diagonal lines; ECharts draws no decal in a markArea
    if (!hatches[colour]) {
      const canvas = document.createElement('canvas'), size = canvas.width = canvas.height = 8;
      const pen = canvas.getContext('2d');
      pen.strokeStyle = colour; pen.lineWidth = 2; pen.beginPath();
      for (const at of [-size, 0, size]) { pen.moveTo(at, size); pen.lineTo(at + size, 0); }
      pen.stroke();
      hatches[colour] = { image: canvas, repeat: 'repeat' };
    }
    return hatches[colour];
  };

  // Runs when the element is there: its script can come before the browser has made it.
  const later = (id, find, use, tries = 40) => {
    const found = find();
    if (found) use(found); else if (tries) setTimeout(() => later(id, find, use, tries - 1), 50);
  };
  const made = (tag, parent, classes) => {
    const e = document.createElement(tag);
    if (classes) e.className = classes;
    parent.append(e);
    return e;
  };
  const words = (parent, text) => { // text only, never markup; a long word can break after an underscore or a slash
    for (const part of String(text).split(/(?<=[_/])/)) parent.append(part, ...(/[_/]$/.test(part) ? [document.createElement('wbr')] : []));
  };
  const fillCell = (td, cell) => {
    if (typeof cell === 'string') { words(td, cell); return; }
    if (cell.classes) td.className = cell.classes;
    if (cell.name) td.dataset.testid = cell.name;
    if (cell.heat !== undefined) td.style.setProperty('--heat', `${Math.round(50 * cell.heat)}%`);
    if (cell.button) {
      const b = cell.button, button = made('button', td, 'in-table');
      button.type = 'button'; button.textContent = b.text; button.setAttribute('aria-label', b.label);
      button.dataset.key = b.label;
      if (b.name) button.dataset.testid = b.name;
      button.addEventListener('click', () => emitEvent(b.event, b.value));
    }
    if (cell.text) words(td, cell.text);
    if (cell.small) { td.append(' '); words(made('small', td), cell.small); }
    if (cell.bar !== undefined) made('i', made('span', td, 'cell-bar')).style.width = `${100 * cell.bar}%`;
  };
  const fillTable = (table, headings, rows) => { // white space between cells, so that their text reads as words
    const focus = table.contains(document.activeElement) ? document.activeElement.dataset.key : undefined;
    table.replaceChildren();
    table.style.setProperty('--columns', headings.length);
    if (headings.length) {
      const tr = made('tr', made('thead', table));
      for (const [text, title] of headings) {
        const th = made('th', tr);
        th.scope = 'col'; words(th, text); tr.append(' ');
        if (title) th.title = title;
      }
    }
    const body = made('tbody', table);
    for (const row of rows) {
      const tr = made('tr', body, row.classes);
      if (row.name) tr.dataset.testid = row.name;
      row.cells.forEach((cell, i) => {
        const td = made(i ? 'td' : 'th', tr);
        if (!i) td.scope = 'row';
        fillCell(td, cell); tr.append(' ');
      });
    }
    if (focus) [...table.querySelectorAll('button')].find((b) => b.dataset.key === focus)?.focus();
  };

  const shift = window.shift = {
    strip(id, windowMs, threshold) { strips[id] = { windowMs, threshold, points: [], decisions: [], markers: [], gaps: [] }; },
    stripUpdate(id, nowMs, points, marks) {
      const s = strips[id];
      if (!s) return;
      s.points.push(...points);
      Object.assign(s, marks);
      drawStrip(id, nowMs);
    },
    stimulus(points, aois, moved = {}) {
      for (const old of document.querySelectorAll('.stimulus .gaze-point')) old.remove();
      for (const svg of document.querySelectorAll('.stimulus svg')) {
        for (const [, x, y] of points) {
          const dot = document.createElementNS('http://www.w3.org/2000/svg', 'circle');
          dot.setAttribute('class', 'gaze-point'); dot.setAttribute('r', '1.6');
          dot.setAttribute('cx', 100 * x); dot.setAttribute('cy', 60 * y);
          svg.append(dot);
        }
        for (const shape of svg.querySelectorAll('[data-aoi]')) {
          shape.classList.toggle('looked-at', aois.includes(shape.dataset.aoi));
          placeAoi(svg, shape, moved[shape.dataset.aoi]);
        }
      }
    },
    table(id, headings, rows) { later(id, () => document.getElementById(`c${id}`), (table) => fillTable(table, headings, rows)); },
    chart(id, update) { later(id, () => chartOf(id), (chart) => { chart.setOption(update); themed(chart); }); },
    author(name) {
      if (name !== undefined) localStorage.setItem('shift-author', name);
      return localStorage.getItem('shift-author') || '';
    },
    heard(ms) { shift.last = Date.now(); shift.lastText = new Date(ms).toLocaleTimeString(); shift.mark(); },
    mark() {
      const banner = document.querySelector('.old-values');
      if (!banner || !shift.last) return;
      const old = Date.now() - shift.last > OLD_MS;
      document.body.classList.toggle('is-old', old);
      const text = old ? `Old values: last heard from the mesh at ${shift.lastText}. The page goes on by itself.` : '';
      if (banner.textContent !== text) banner.textContent = text;
    },
    jump(id, line) { // put the editor's cursor into a line
      const editor = getElement(id).editor;
      if (!editor || line > editor.state.doc.lines) return;
      editor.dispatch({ selection: { anchor: editor.state.doc.line(line).from }, scrollIntoView: true });
      editor.focus();
    },
    position(s) { // a position on a recording's time line, minutes and seconds
      const whole = Math.max(0, Math.floor(s)), pad = (n) => String(n).padStart(2, '0');
      const h = Math.floor(whole / 3600), m = Math.floor(whole / 60) % 60;
      return (h ? `${h}:${pad(m)}` : `${m}`) + `:${pad(whole % 60)}`;
    },
    cursor(id, s, charts) {
      const chart = chartOf(id);
      if (chart) chart.setOption({ series: [...Array(charts).keys()].map((i) => (
        { id: `cursor${i}`, markLine: { data: [{ xAxis: s }] } })) });
    },
    saveSvg(id, name) { // the chart is drawn as SVG anyway, so that the file is what is seen
      const svg = getElement(id).$el.querySelector('svg').cloneNode(true);
      svg.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
      const link = document.createElement('a');
      link.href = URL.createObjectURL(new Blob([svg.outerHTML], { type: 'image/svg+xml' }));
      link.download = name; link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    },
    theme(next) {
      if (next) localStorage.setItem('shift-theme', next);
      return localStorage.getItem('shift-theme') || 'auto';
    },
    position(seconds) {
      const whole = Math.floor(seconds), two = (n) => String(n).padStart(2, '0');
      const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
      return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
    },
    timeline(id) {
      later(id, () => chartOf(id), (chart) => {
        themed(chart);
        chart.getZr().on('click', (event) => {
          const point = [event.offsetX, event.offsetY];
          const grid = [0, 1, 2, 3].find((i) => chart.containPixel({ gridIndex: i }, point));
          if (grid !== undefined) emitEvent('recording-seek', chart.convertFromPixel({ gridIndex: grid }, point)[0]);
        });
      });
    },
    cursor(id, seconds) { // one line through all charts of the time line
      const chart = chartOf(id);
      if (!chart) return;
      const grids = chart.getOption().grid, last = grids[grids.length - 1];
      chart.setOption({ series: [{ id: 'cursor', markLine: { data: seconds === null ? [] : [
        [{ xAxis: seconds, y: grids[0].top }, { xAxis: seconds, y: last.top + last.height }]] } }] });
    },
    saveSvg(id, name, seconds) { // in light colours, which print, and without the cursor
      const chart = chartOf(id);
      if (!chart) return;
      themed(chart, COLOURS.light);
      chart.setOption({ backgroundColor: '#ffffff' });
      shift.cursor(id, null);
      const link = document.createElement('a');
      link.href = chart.getDataURL({ type: 'svg', excludeComponents: ['dataZoom'] });
      link.download = name;
      link.click();
      chart.setOption({ backgroundColor: 'transparent' });
      themed(chart);
      shift.cursor(id, seconds);
    },
    shortcuts(on) {
      if (on !== undefined) localStorage.setItem('shift-shortcuts', on ? 'on' : 'off');
      return localStorage.getItem('shift-shortcuts') !== 'off';
    },
  };

  // One key each: [m] marker, [o] override, [e] end. A key that is typed into a field, or with a modifier, is not one.
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !shift.shortcuts()) return;
    if (event.target.closest('input, textarea, select, [contenteditable=true], .q-dialog')) return;
    const target = document.querySelector(`[data-shortcut="${CSS.escape(event.key)}"]`);
    if (!target) return;
    event.preventDefault();
    const field = target.matches('input') ? target : target.querySelector('input');
    if (field) field.focus(); else target.click();
  });

  document.addEventListener('DOMContentLoaded', () => {
    setInterval(shift.mark, 500);
    setInterval(() => { // tables that scroll are reached by the keyboard
      for (const e of document.querySelectorAll('.q-table__middle:not([tabindex]), .lines:not([tabindex]), .cm-scroller:not([tabindex="0"])')) e.tabIndex = 0;
      for (const e of document.querySelectorAll('.cm-content:not([aria-label])')) e.setAttribute('aria-label', 'Text of the study file');
    }, 500);
    new MutationObserver(retheme).observe(document.body, { attributes: true, attributeFilter: ['class'] });
    new MutationObserver((changes) => {
      if (changes.some((c) => [...c.addedNodes].some((n) => n.querySelector &&
          (n.matches('.nicegui-echart') || n.querySelector('.nicegui-echart'))))) setTimeout(retheme, 200);
    }).observe(document.body, { childList: true, subtree: true });
    setTimeout(retheme, 500);
  });
})();
