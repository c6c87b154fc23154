import { describe, expect, it } from 'vitest'
import { contents, renderPage, slug } from '../guide'
import { excerpt, search, type Section } from '../src/help/search'

const page = (text: string, figure: (path: string) => string | null = () => null) => renderPage('here', 'Reference', text, new Set(['here', 'there']), figure)

describe('the guide in the page', () => {
  it('has the pages of the book in its order', () => {
    const summary = '# Summary\n\n[First](one.md)\n\n# Theory\n\n- [Second](two-b.md)\n- [Draft]()\n'
    expect(contents(summary)).toEqual([{ name: 'one', chapter: '' }, { name: 'two-b', chapter: 'Theory' }])
  })
  it('names its headings as the book does, also repeated ones', () => {
    expect(slug('Work on a `running` bench, M_S!')).toBe('work-on-a-running-bench-m_s')
    const { html, title } = page('# Laws\n\n## Paper\n\n## Paper\n')
    expect(title).toBe('Laws')
    expect(html).toContain('<h2 id="paper">')
    expect(html).toContain('<h2 id="paper-1">')
  })
  it('opens links to its pages inside and other links in a new tab, and drops broken links', () => {
    const { html } = page('# A\n\n[there](there.md#an-anchor) [here](#below) [web](https://a.example) [gone](../gone.csv)')
    expect(html).toContain('href="/help?page=there&amp;at=an-anchor"')
    expect(html).toContain('href="/help?page=here&amp;at=below"')
    expect(html).toContain('href="https://a.example" target="_blank" rel="noreferrer"')
    expect(html).not.toContain('gone.csv')
  })
  it('shows other HTML as text', () => {
    expect(page('# A\n\n<img src=x onerror=alert(1)> and <b>bold</b>').html).not.toMatch(/<img|<b>/)
    expect(page('<i>M</i><sub>S</sub>').html).toContain('<i>M</i><sub>S</sub>')
    expect(page('<p class="equation">a &nbsp; <b>b</b></p>').html).toContain('<p class="equation">a &nbsp; &lt;b>')
    expect(page('<p onclick="x()">').html).not.toContain('<p onclick')
    expect(page('# A\n\n```\n<script>\n```').html).toContain('&lt;script>')
  })
  it('shows a figure, or its alternative text if there is none', () => {
    expect(page('# A\n\n![A curve](figures/a.svg)', () => '/assets/a.svg').html).toContain('<img src="/assets/a.svg" alt="A curve"')
    expect(page('# A\n\n![A curve](figures/a.svg)').html).toContain('<em>A curve</em>')
  })
})

describe('the search in the guide', () => {
  const section = (title: string, text: string): Section => ({ page: page('# A'), anchor: slug(title), title, text })
  const guide = [section('Files', 'A record of the brake.'), section('The brake', 'Acts in one tick.'), section('Else', 'Nothing')]
  const titles = (query: string) => search(query, guide, [], []).map((one) => (one.kind === 'section' ? one.section.title : one.kind))
  it('lists matches in titles first, and nothing for an empty query', () => {
    expect(titles('brake')).toEqual(['The brake', 'Files'])
    expect(titles('brake tick')).toEqual(['The brake'])
    expect(titles('  ')).toEqual([])
    expect(titles('zebra')).toEqual([])
  })
  it('finds commands by name', () => {
    expect(search('torque', guide, [], [{ name: 'Torque on', key: '' }, { name: 'Undo', key: 'Ctrl Z' }])).toEqual([{ kind: 'command', name: 'Torque on', key: '' }])
  })
  it('shows the text around a match', () => {
    const text = `${'before '.repeat(40)}needle ${'after '.repeat(80)}`
    const shown = excerpt(text, ['needle'])
    expect(shown).toContain('needle')
    expect(shown.startsWith('… ') && shown.endsWith(' …') && shown.length < 300).toBe(true)
    expect(excerpt('short', ['none'])).toBe('short')
  })
})
