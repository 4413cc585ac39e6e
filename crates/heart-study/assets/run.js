"use strict";
// The viewer of the beat. All that it needs is in the page: the library and the volumes, compressed and in base64.
(async () => {
  const element = (id) => document.getElementById(id);
  const say = (text) => { element("beat-state").textContent = text; };
  const unpacked = async (id) => {
    const bytes = Uint8Array.from(atob(element(id).textContent.trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  };
  try {
    if (!document.createElement("canvas").getContext("webgl2")) throw new Error("this browser has no WebGL2");
    element("beat-view").hidden = false; // sizes are those of what is shown
    (0, eval)(await unpacked("niivue"));
    const viewer = new niivue.Niivue({
      isRadiologicalConvention: true,
      isColorbar: true,
      isRuler: true,
      isOrientCube: true,
      showAllOrientationMarkers: true,
      show3Dcrosshair: true,
      sagittalNoseLeft: true,
      multiplanarLayout: 2, // a grid
      multiplanarShowRender: 1, // always
      crosshairWidth: 0.3,
      crosshairColor: [0.9, 0.6, 0.1, 0.7],
      fontColor: [1, 0.8, 0.4, 1],
      rulerWidth: 2,
      multiplanarPadPixels: 6,
      backColor: [0.1, 0.1, 0.1, 1],
      loadingText: "",
      logLevel: "error",
    });
    await viewer.attachToCanvas(element("beat"));
    const choose = element("beat-volume"), slider = element("beat-gate"), play = element("beat-play");
    let timer = null;
    const show = (gate) => {
      const volume = viewer.volumes[0], n = volume.nFrame4D;
      const k = ((gate % n) + n) % n;
      viewer.setFrame4D(volume.id, k);
      slider.value = k;
      const cardiac = Number(element(choose.value).dataset.gates);
      const respiratory = cardiac < n ? `, respiratory gate ${Math.floor(k / cardiac)} (of ${n / cardiac})` : "";
      say(n > 1 ? `gate ${k} (of ${n})${respiratory}` : "");
      return k;
    };
    const open = async () => {
      const data = element(choose.value);
      while (viewer.volumes.length) viewer.removeVolumeByIndex(0);
      viewer.addVolume(await niivue.NVImage.loadFromBase64({
        base64: data.textContent.trim(),
        name: `${choose.value}.nii.gz`,
        colormap: "gray",
        cal_min: Number(data.dataset.black),
        cal_max: Number(data.dataset.white),
      }));
      viewer.setSliceType(viewer.sliceTypeMultiplanar);
      slider.max = viewer.volumes[0].nFrame4D - 1;
      play.disabled = viewer.volumes[0].nFrame4D < 2;
      show(Number(slider.value));
    };
    const stop = () => { clearInterval(timer); timer = null; play.textContent = "play"; };
    const start = () => {
      const seconds = Number(element(choose.value).dataset.seconds);
      timer = setInterval(() => show(Number(slider.value) + 1), 1000 * Math.max(seconds, 0.04));
      play.textContent = "stop";
    };
    play.onclick = () => (timer === null ? start() : stop());
    slider.oninput = () => { stop(); show(Number(slider.value)); };
    choose.onchange = open;
    await open();
    // `#gate=3` opens the page at gate 3, counted from 0, at rest.
    const asked = /[#&]gate=(\d+)/.exec(location.hash);
    if (asked) show(Number(asked[1]));
    else if (!play.disabled) start();
    document.body.dataset.ready = "yes";
  } catch (error) {
    element("beat-view").hidden = true;
    say(`The viewer cannot be shown here (${error.message || error}); the sections below show the same volumes.`);
    document.body.dataset.ready = "no";
  }
})();
