"""Scripts that must be refused, and what the error says."""

from __future__ import annotations


def filter_xml(name: str, *parameters: str) -> str:
    return f'<filter name="{name}">' + "".join(f"<Param {p}/>" for p in parameters) + "</filter>"


MESH = filter_xml("generate_quad_mesh_from_image")
ROTATE = "Transform: Rotate"
GOOD_ENUM = 'enum_cardinality="2" enum_val0="a" enum_val1="b"'

#: whole files that are no filter script
BAD_FILES = {
    "empty": (b"", "not XML"),
    "no XML": (b"Laplacian Smooth", "not XML"),
    "cut off": (b"<FilterScript><filter name='a'>", "not XML"),
    "wrong encoding": (b'<?xml version="1.0" encoding="klingon"?><FilterScript/>', "not XML"),
    "other root": (b"<FilterScripts/>", "FilterScripts"),
    "no filter": (b"<FilterScript/>", "no filter"),
    "zero bytes": (b"<FilterScript>\0\0</FilterScript>", "not XML"),
    "billion laughs": (
        b'<!DOCTYPE FilterScript [<!ENTITY a "ha">'
        + b"".join(b'<!ENTITY %c "&%c;&%c;&%c;&%c;&%c;&%c;&%c;&%c;">' % (c + 1, *[c] * 8) for c in range(97, 110))
        + b']><FilterScript><filter name="&n;"/></FilterScript>',
        "entities",
    ),
    "billion laughs in UTF-16": (
        '<?xml version="1.0" encoding="utf-16"?><!DOCTYPE FilterScript [<!ENTITY a "ha">]><FilterScript>'
        '<filter name="&a;"/></FilterScript>'.encode("utf-16"),
        "entities",
    ),
    "external entity": (
        b'<!DOCTYPE FilterScript [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
        b'<FilterScript><filter name="&x;"/></FilterScript>',
        "entities",
    ),
    "external document type": (b'<!DOCTYPE FilterScript SYSTEM "http://x/y.dtd"><FilterScript/>', "document type"),
    "parameter entity": (b'<!DOCTYPE FilterScript [<!ENTITY % p SYSTEM "file:///x"> %p;]><FilterScript/>', "entities"),
    "attributes by declaration": (
        b'<!DOCTYPE FilterScript [<!ATTLIST filter name CDATA "x">]><FilterScript/>',
        "declares",
    ),
    "undefined entity": (b"<FilterScript><filter name='&nbsp;'/></FilterScript>", "not XML"),
    "form of meshlabserver": (b"<FilterScript><xmlfilter name='Loop'/></FilterScript>", "xmlfilter.*2020"),
}

#: elements between <FilterScript> and </FilterScript>
BAD_ELEMENTS = {
    "text between elements": ("Laplacian Smooth", "text"),
    "parameter outside a filter": ("<Param name='a' type='RichInt' value='1'/>", "<Param>"),
    "filter in a filter": (f"<filter name='Image to Quad Mesh'>{MESH}</filter>", "<filter>"),
    "element in a parameter": (
        "<filter name='x'><Param name='a' type='RichInt' value='1'><a/></Param></filter>",
        "<a>",
    ),
    "filter without a name": ("<filter/>", "without a name"),
    "parameter without a name": (filter_xml("Image: Crop", 'type="RichInt" value="1"'), "without a name"),
    "parameter without a type": (filter_xml("Image: Crop", 'name="crop" value="1"'), "no type"),
    "unknown type": (filter_xml("Image: Crop", 'name="crop" type="RichText" value="1"'), "RichText"),
    "parameter twice": (filter_xml("Image: Crop", *['name="crop" type="RichString" value=""'] * 2), "twice"),
    "one parameter by two names": (
        filter_xml(
            "Boundary: Smooth",
            'name="maxShift" type="RichDynamicFloat" value="1" min="0" max="1"',
            'name="max_shift" type="RichDynamicFloat" value="1" min="0" max="1"',
        ),
        "twice",
    ),
    "unknown filter of ours": (filter_xml("Image to Quat Mesh"), "did you mean 'Image to Quad Mesh'"),
    "unknown parameter of ours": (
        filter_xml("Image to Quad Mesh", 'name="maxShft" type="RichFloat" value="1"'),
        "did you mean 'maxShift'",
    ),
    "wrong type": (filter_xml("Image to Quad Mesh", 'name="size" type="RichInt" value="4"'), "must be RichFloat"),
    "not a number": (filter_xml("Image to Quad Mesh", 'name="size" type="RichFloat" value="four"'), "'four'"),
    "NaN": (filter_xml("Image to Quad Mesh", 'name="size" type="RichFloat" value="nan"'), "finite"),
    "infinite": (filter_xml("Image to Quad Mesh", 'name="size" type="RichFloat" value="inf"'), "finite"),
    "no value": (filter_xml("Image to Quad Mesh", 'name="size" type="RichFloat"'), "'value' is missing"),
    "zero size": (filter_xml("Image to Quad Mesh", 'name="size" type="RichFloat" value="0"'), "size is 0"),
    "negative size": (filter_xml("Image to Quad Mesh", 'name="size" type="RichFloat" value="-4"'), "size is -4"),
    "whole number with a point": (
        filter_xml("Image to Quad Mesh", 'name="threads" type="RichInt" value="1.5"'),
        "whole",
    ),
    "whole number too long": (
        filter_xml("Image to Quad Mesh", 'name="threads" type="RichInt" value="99999999999"'),
        "from",
    ),
    "not true or false": (
        filter_xml("Image to Quad Mesh", 'name="dropTransparent" type="RichBool" value="yes"'),
        "true or false",
    ),
    "limits missing": (
        filter_xml("Image to Quad Mesh", 'name="growth" type="RichDynamicFloat" value="2"'),
        "'min' is missing",
    ),
    "outside its own limits": (
        filter_xml("Image to Quad Mesh", 'name="growth" type="RichDynamicFloat" value="9" min="1" max="2"'),
        "outside",
    ),
    "outside our limits": (
        filter_xml("Image to Quad Mesh", 'name="growth" type="RichDynamicFloat" value="99" min="1" max="100"'),
        "1.01 to 10",
    ),
    "choice that is none": (
        filter_xml("Image to Quad Mesh", f'name="effort" type="RichEnum" value="2" {GOOD_ENUM}'),
        "0 to 1",
    ),
    "number of choices missing": (
        filter_xml("Image to Quad Mesh", 'name="effort" type="RichEnum" value="1"'),
        "cardinality",
    ),
    "choice without a text": (
        filter_xml("Image to Quad Mesh", 'name="effort" type="RichEnum" value="1" enum_cardinality="2" enum_val0="a"'),
        "enum_val1",
    ),
    "choice that our filter lacks": (
        filter_xml(
            "Image: Extract Material Boundaries",
            'name="policy" type="RichEnum" value="7" enum_cardinality="8" '
            + " ".join(f'enum_val{i}="x"' for i in range(8)),
        ),
        "policy is 7",
    ),
    "text that cannot be read": (filter_xml("Image: Crop", 'name="crop" type="RichString" value="1,2"'), "X0,Y0,X1,Y1"),
    "sizes without a number": (
        filter_xml("Boundary: Smooth", 'name="materialSizes" type="RichString" value="a=b"'),
        "'b' is not a number",
    ),
    "file above the folder": (
        MESH + filter_xml("Export Quad Mesh", 'name="fileName" type="RichString" value="../m.vtu"'),
        "outside",
    ),
    "file with an absolute path": (
        MESH + filter_xml("Export Quad Mesh", 'name="fileName" type="RichString" value="/tmp/m.vtu"'),
        "outside",
    ),
    "file without a name": (
        MESH + filter_xml("Export Quad Mesh", 'name="fileName" type="RichString" value=""'),
        "outside",
    ),
    "format that is none": (
        MESH + filter_xml("Export Quad Mesh", 'name="fileName" type="RichString" value="m.docx"'),
        "docx",
    ),
    "no mesh yet": (filter_xml("Compute Quad Quality Measures"), "no mesh"),
    "material that is none": (
        filter_xml("Image: Drop Materials", 'name="drop" type="RichString" value="9"'),
        "material '9'",
    ),
    "everything dropped": (
        filter_xml("Image: Drop Materials", 'name="drop" type="RichString" value="0,3,5"') + MESH,
        "filter",
    ),
}

#: the same with filters of MeshLab
BAD_MESHLAB = {
    "unknown filter": (filter_xml("Laplacian Smoth"), "laplacian smooth"),
    "unknown parameter": (
        filter_xml("Laplacian Smooth", 'name="steps" type="RichInt" value="1"'),
        "no parameter 'steps'",
    ),
    "MeshLab's wrong type": (
        filter_xml("Laplacian Smooth", 'name="stepSmoothNum" type="RichFloat" value="1"'),
        "must be RichInt or RichMesh",
    ),
    "colour cut off": (
        filter_xml("Vertex Color Filling", 'name="color1" type="RichColor" r="1" g="2" b="3"'),
        "'a' is missing",
    ),
    "colour out of range": (
        filter_xml("Vertex Color Filling", 'name="color1" type="RichColor" r="1" g="2" b="300" a="0"'),
        "0 to 255",
    ),
    "point cut off": (filter_xml(ROTATE, 'name="customAxis" type="RichDirection" x="1" y="2"'), "'z' is missing"),
    "matrix cut off": (
        filter_xml("Matrix: Set/Copy Transformation", 'name="TransformMatrix" type="RichMatrix44f" val0="1"'),
        "'val1'",
    ),
    "clamped by MeshLab": (
        filter_xml(ROTATE, 'name="angle" type="RichDynamicFloat" value="1000" min="-360" max="360"'),
        "clamp",
    ),
    "percentage without limits": (
        filter_xml("Merge Close Vertices", 'name="Threshold" type="RichAbsPerc" value="0.1"'),
        "'min' is missing",
    ),
    "file of MeshLab outside": (
        filter_xml("NXS Build", 'name="input_file" type="RichOpenFile" value="/etc/passwd" exts_cardinality="0"'),
        "outside",
    ),
    "file of MeshLab as a text": (
        filter_xml("NXS Build", 'name="output_file" type="RichString" value="../x"'),
        "outside",
    ),
    "texture in a folder": (
        filter_xml("Set Texture", 'name="textName" type="RichString" value="../x.png"'),
        "without a folder",
    ),
    "good start, bad end": (MESH + "\n" + filter_xml("nope"), "script.mlx:4: unknown filter 'nope'"),
}

#: right scripts whose filters of MeshLab fail: what is left is the last good mesh
FAILING = {
    "hangs": (filter_xml("Subdivision Surfaces: Doo Sabin"), "Doo Sabin.*did not end within 2 s"),
    "crashes": (filter_xml("MLS projection (APSS)"), "APSS.*ended the MeshLab process .signal 11"),
    "aborts": (filter_xml("Depth complexity"), "Depth complexity.*ended the MeshLab process"),
    "fails": (filter_xml("Set Texture"), "Set Texture.*Wedge Texture"),
    "mesh that is none": (
        filter_xml("ICP Between Meshes", 'name="SourceMesh" type="RichMesh" value="7"'),
        "there is no mesh 7",
    ),
    "choice that MeshLab lacks": (
        filter_xml(
            ROTATE,
            'name="rotAxis" type="RichEnum" value="8" enum_cardinality="9" '
            + " ".join(f'enum_val{i}="x"' for i in range(9)),
        ),
        "8",
    ),
}
