// The flight's own thread: Emscripten's function `roborun` stands above. It answers {wasm} with the choices there are, and flies
// {wasm, flight: [world, vehicle, design, seed]} in one go, message by message.
self.onmessage = async ({ data: { wasm, flight } }) => {
  const tell = (topic, time_s, text) => postMessage([topic, time_s, text]);
  const program = await roborun({ wasmBinary: wasm, tell });
  postMessage(['choices', 0, program.ccall('choices', 'string', [], [])]);
  if (!flight) return;
  const begin_ms = performance.now();
  program.ccall('fly', null, flight.map(() => 'string'), flight);
  postMessage(['ended', (performance.now() - begin_ms) / 1000, 'null']);
};
