"""One file that fetches nothing and runs nothing but its own program."""

import base64
import hashlib
import json
import re

from hcpg.report.page.writing import html_page


def digest(text):
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def test_the_policy_allows_the_inlined_style_and_program_and_no_request():
    text = html_page({"title": "t"}, "plain")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    style, script = re.search(r"<style>(.*?)</style>.*<script>(.*?)</script>", text, re.DOTALL).groups()
    assert f"default-src 'none'; style-src {digest(style)}; script-src {digest(script)}; " in policy
    assert "unsafe" not in policy
    assert re.findall(r'(?:src|href)="([^"]*)"', text) == ["data:,", "#results"]


def test_data_can_neither_end_its_element_nor_fill_another_place():
    hostile = "</script><b>{{script}}<!-- & \u2028"
    text = html_page({"title": hostile, "x": [hostile]}, hostile)
    data = re.search(r'type="application/json">(.*?)</script>', text, re.DOTALL)[1]
    assert json.loads(data) == {"title": hostile, "x": [hostile]}
    assert text.count("<b>") == 0
    assert text.count("</script>") == 2
    assert "<title>&lt;/script&gt;&lt;b&gt;{{script}}" in text


def test_the_plain_table_is_there_without_javascript():
    assert '<noscript><pre class="wide">| a &lt; b |</pre></noscript>' in html_page(
        {"title": ""}, "| a < b |"
    )
