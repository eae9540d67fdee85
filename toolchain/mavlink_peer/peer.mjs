// node-mavlink reads what roborun wrote (usage: peer.mjs read FRAMES OURS.jsonl), or writes what roborun is to read
// (peer.mjs write OURS.jsonl FRAMES WANTED.jsonl). One JSON object per message, as `roborun mavlink decode --json` prints them.
import { createReadStream, readFileSync, writeFileSync } from 'node:fs'
import mavlink from 'node-mavlink'
import mappings from 'mavlink-mappings'

const registry = { ...mappings.minimal.REGISTRY, ...mappings.standard.REGISTRY, ...mappings.common.REGISTRY, ...mappings.ardupilotmega.REGISTRY }
// 64-bit integers as text: JSON.parse would round them.
const lines = (path) => readFileSync(path, 'utf8').trim().split('\n')
  .map((line) => JSON.parse(line.replace(/([:[,])(-?\d{16,})(?=[,\]}])/g, '$1"$2"')))
// Numbers that JSON does not have come as text; the bits of a NaN are not node-mavlink's affair.
const number = (x) => (typeof x === 'string' && x.startsWith('NaN') ? NaN : Number(x))
const is_text = (field) => field.type === 'char[]' || field.type === 'char'

function same(type, theirs, ours) {
  if (type === 'char' || type === 'char[]') return String(theirs).replace(/\0+$/, '') === String(ours).replace(/\0+$/, '')
  if (Array.isArray(ours)) return ours.length === theirs.length && ours.every((x, i) => same(type.replace('[]', ''), theirs[i], x))
  if (type.includes('int64')) return BigInt(theirs) === BigInt(ours)
  if (type === 'float') return Object.is(Math.fround(theirs), Math.fround(number(ours)))  // JSON has a float's shortest text
  return Number(theirs) === number(ours)
}

function read(frames, ours_path) {
  const ours = lines(ours_path)
  const unknown = new Set()
  let compared = 0, at = 0, read_count = 0, wrong = 0
  const parser = createReadStream(frames).pipe(new mavlink.MavLinkPacketSplitter()).pipe(new mavlink.MavLinkPacketParser())
  parser.on('data', (packet) => {
    const clazz = registry[packet.header.msgid]
    // What it does not know it steps over.
    while (at < ours.length && ours[at].msgid !== packet.header.msgid) unknown.add(ours[at++].name)
    const wanted = ours[at++]
    read_count++
    const head = wanted && packet.header.msgid === wanted.msgid && packet.header.seq === wanted.seq &&
      packet.header.sysid === wanted.sysid && packet.header.compid === wanted.compid
    if (!head) { wrong++; console.log('header', packet.header, wanted); return }
    const data = packet.protocol.data(packet.payload, clazz)
    for (const field of clazz.FIELDS) {
      if (!(field.source in wanted.fields)) continue
      compared++
      if (same(field.type, data[field.name], wanted.fields[field.source])) continue
      wrong++
      console.log(wanted.name, field.source, data[field.name], wanted.fields[field.source])
    }
  })
  parser.on('end', () => {
    while (at < ours.length) unknown.add(ours[at++].name)
    console.log(`node-mavlink read ${read_count} of ${ours.length} messages, ${compared} fields, ${wrong} wrong; not known to it: ${[...unknown].join(' ') || 'none'}`)
    process.exit(wrong === 0 && unknown.size <= 1 && compared > 1000 ? 0 : 1)
  })
}

function write(ours_path, frames, wanted_path) {
  const parts = [], wanted = []
  const texts = readFileSync(ours_path, 'utf8').trim().split('\n')
  for (const [i, line] of lines(ours_path).entries()) {
    const clazz = registry[line.msgid]
    if (!(line.msgid in registry) || line.version !== 2 || line.signed) continue
    const message = new clazz()
    for (const field of clazz.FIELDS) {
      const value = line.fields[field.source]
      if (value === undefined) continue
      const one = (x) => (field.type.includes('int64') ? BigInt(x) : number(x))
      message[field.name] = is_text(field) ? value : Array.isArray(value) ? value.map(one) : one(value)
    }
    parts.push(new mavlink.MavLinkProtocolV2(line.sysid, line.compid).serialize(message, line.seq))
    wanted.push(texts[i])
  }
  writeFileSync(frames, Buffer.concat(parts))
  writeFileSync(wanted_path, wanted.map((line) => line + '\n').join(''))
  console.log(`node-mavlink wrote ${wanted.length} messages`)
}

const [what, ...paths] = process.argv.slice(2)
if (what === 'read') read(...paths)
else write(...paths)
