//! The script by which pages turn their views.

/// Turns every view of a page; the same formulas as `seen` of `scene`.
pub const SCRIPT: &str = "
for (const s of document.querySelectorAll('svg.scene')) {
  let yaw = +s.dataset.yaw, pitch = +s.dataset.pitch, from = null;
  const k = +s.dataset.scale, box = s.viewBox.baseVal, W = box.width / 2, H = box.height / 2;
  const parts = [...s.querySelectorAll('[data-p]')].map(e =>
    [e, e.dataset.p.split('|').map(l => l.split(' ').map(p => p.split(',').map(Number)))]);
  const draw = () => {
    const c = Math.cos(yaw), d = Math.sin(yaw), e = Math.cos(pitch), f = Math.sin(pitch);
    const at = ([x, y, z]) => [(W + k * (x * c + z * d)).toFixed(1), (H + k * (y * e - (z * c - x * d) * f)).toFixed(1)];
    for (const [el, lines] of parts) {
      if (el.tagName === 'text') { const [x, y] = at(lines[0][0]); el.setAttribute('x', x); el.setAttribute('y', y); continue; }
      el.setAttribute('d', lines.map(l => 'M' + l.map(p => at(p).join(' ')).join('L') + (l.length === 1 ? 'h0' : '')).join(''));
    }
  };
  const turn = (x, y) => { yaw += x; pitch = Math.max(-1.57, Math.min(1.57, pitch + y)); draw(); };
  s.addEventListener('pointerdown', e => { from = [e.clientX, e.clientY]; s.setPointerCapture(e.pointerId); });
  s.addEventListener('pointermove', e => {
    if (!from) return;
    turn((from[0] - e.clientX) * 0.01, (e.clientY - from[1]) * 0.01); from = [e.clientX, e.clientY];
  });
  for (const end of ['pointerup', 'pointercancel']) s.addEventListener(end, () => { from = null; });
  s.addEventListener('keydown', e => {
    const step = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
    if (step) { e.preventDefault(); turn(...step); }
  });
}
";
