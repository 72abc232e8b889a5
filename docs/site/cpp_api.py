# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Writes the C++ reference as Markdown, from Doxygen's XML of the public headers."""

import re
import xml.etree.ElementTree as ElementTree


def page(xml, headers):
    """One section per header; `headers` are their names, in order."""
    namespace = ElementTree.parse(xml / "namespaceloopbit.xml").getroot()
    members = list(namespace.iter("memberdef"))
    classes = [ElementTree.parse(xml / f"{inner.get('refid')}.xml").getroot().find("compounddef")
               for inner in namespace.iter("innerclass")]
    lines = []
    for header in headers:
        lines.append(f"## {header}\n")
        for compound in classes:
            if header_of(compound) == header and is_for_users(compound):
                lines += class_lines(compound)
        for member in members:
            if header_of(member) == header:
                lines += member_lines(member)
    return "\n".join(lines)


def header_of(definition):
    return definition.find("location").get("file").rpartition("/")[2]


def is_for_users(compound):
    """Excludes classes that are only forward declared."""
    return bool(prose(compound)) or compound.find("sectiondef") is not None


def class_lines(compound):
    name = compound.findtext("compoundname").removeprefix("loopbit::")
    yield f"### {compound.get('kind')} {name}\n"
    yield prose(compound)
    fields = []
    for member in compound.iter("memberdef"):
        if member.get("prot") != "public" or member.findtext("name") == "fields":
            continue
        if member.get("kind") == "variable" and member.get("static") == "no":
            fields.append(f"| `{code(member)}` | {prose(member).replace(chr(10), ' ')} |")
        else:
            yield from member_lines(member)
    if fields:
        yield "\n".join(["| field | |", "|---|---|", *fields]) + "\n"


def member_lines(member):
    if member.get("kind") not in ("function", "variable", "enum", "typedef"):
        return
    ends = ("=default", "=delete", "= default", "= delete")
    if member.findtext("argsstring", "").endswith(ends) or "~" in member.findtext("name"):
        return
    yield f"```cpp\n{code(member)};\n```\n"
    yield prose(member)
    values = [f"- `{value.findtext('name')}`: {prose(value)}" for value in member.iter("enumvalue")]
    if values:
        yield "\n".join(values) + "\n"


def code(member):
    """A declaration on one line."""
    kind = "".join(member.find("type").itertext()) if member.find("type") is not None else ""
    if member.get("kind") == "enum":
        kind = "enum class"
    template = member.find("templateparamlist")
    if template is not None:
        names = ["".join(each.itertext()) for each in template.findall("param")]
        kind = f"template <{', '.join(names)}> {kind}"
    initializer = "".join(member.find("initializer").itertext()) if (
        member.find("initializer") is not None) else ""
    text = f"{kind} {member.findtext('name')}{member.findtext('argsstring') or ''} {initializer}"
    text = re.sub(r"\s+", " ", text).strip()
    # In the style of clang-format.
    text = re.sub(r" ?([&*]+) ?(?=\w+[,)=])", r"\1 ", text)
    text = re.sub(r"(?<=[<]) | (?=[>,])", "", text)
    return text.replace("|", r"\|") if member.get("kind") == "variable" else broken(text)


def broken(text, width=80):
    """A long declaration, with one parameter per line."""
    if len(text) <= width:
        return text
    result, depth = "", 0
    for c in text:
        depth += (c in "({") - (c in ")}")
        # Commas within <> do not separate parameters.
        depth_of_template = result.count("<") - result.count(">") + result.count("->")
        result += c
        if depth == 1 and depth_of_template == 0 and c in "(,":
            result += "\n   "
    return result.replace("(\n   ", "(\n    ")


def prose(element):
    """The description, with Markdown escaped."""
    found = [paragraphs(element.find(part))
             for part in ("briefdescription", "detaileddescription")
             if element.find(part) is not None]
    return "\n".join(text for text in found if text)


def paragraphs(description):
    lines = []
    for paragraph in description.findall("para"):
        items = paragraph.findall("itemizedlist/listitem")
        own = inline(paragraph, without="itemizedlist").strip()
        if own:
            lines.append(own + "\n")
        lines += [f"- {inline(item).strip()}" for item in items] + [""] * bool(items)
    return "\n".join(lines)


def inline(element, without=""):
    text = escaped(element.text)
    for child in element:
        if child.tag == "computeroutput":
            text += f"`{''.join(child.itertext())}`"
        elif child.tag != without:
            text += inline(child, without)
        text += escaped(child.tail)
    return text


def escaped(text):
    return re.sub(r"([\\*_\[\]<>|`#])", r"\\\1", text or "")
