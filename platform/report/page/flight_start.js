// The page of a flight whose story is in it.

unpack().then(packed => packed.json()).then(story => {
  window.page = new Page(story);
  if (story.live) follow_flight(window.page);
  document.documentElement.dataset.ready = 'yes';
}).catch(error => {
  $('note').textContent = `This page cannot be drawn: ${error.message}. It needs a browser of 2023 or newer.`;
  throw error;
});
