// The page's token: from the fragment of its address (`#token=…`), which no request, log or referrer carries, then from
// this tab's memory, which ends with the tab.

const KEY = 'tryon.token';

/**
 * Moves the token of the address into `store` and takes it off the address bar.
 * @param {{location: Location, history: History, store: Storage}} page
 * @returns {string} the token, empty when there is none
 */
export function takeToken({ location, history, store }) {
  const fragment = new URLSearchParams(location.hash.slice(1));
  const given = fragment.get('token');
  if (given) {
    fragment.delete('token');
    const rest = fragment.toString();
    history.replaceState(null, '', location.pathname + location.search + (rest && `#${rest}`));
    store.setItem(KEY, given);
  }
  return given ?? store.getItem(KEY) ?? '';
}
